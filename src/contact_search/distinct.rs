//! One contact for each that is geometrically distinct: what lies on borders is found with every pair that shares them.

use super::contact::Contact;
use super::pair::PairKind;
use crate::math::{Vec3, dot, scale};
use crate::parallel::Par;
use std::sync::atomic::{AtomicU8, Ordering};

/// Leaves one contact per geometrically distinct one of a list sorted by pair: drops what repeats an earlier contact, and
/// what is no closest point.
///
/// Closest points on a border, `(p, edge)` or `(p, vertex)`, are found with every pair that shares that border; the
/// first pair is kept, with the largest thickness. They are no contact of their own where a face at that border is
/// strictly nearer to `p`: then the point slides off the border into the face, which has its own row. A vertex that is
/// nearest to an edge or a corner keeps that row. Of two vertices both must have something nearer. Cost: linear.
pub(super) fn distinct(contacts: &mut Vec<Contact>, borders: &mut Borders, par: Par) {
    if contacts.is_empty() {
        return;
    }
    borders.empty(contacts.len());
    for i in 0..contacts.len() {
        let Some(border) = Border::of(&contacts[i], i) else { continue };
        // The same vertices may carry two contacts on opposite sides only if the normals differ.
        match borders.with_key(border.key).last().filter(|last| dot(last.normal, border.normal) > 0.5) {
            Some(first) => {
                let first = first.contact;
                contacts[first].thickness = contacts[first].thickness.max(contacts[i].thickness);
                borders.kept[i] = false;
            }
            None => borders.insert(border),
        }
    }
    let faces = contacts.partition_point(|c| c.pair.kind == PairKind::VertexFace);
    par.for_each_block(&mut contacts[..faces], |_, contacts| {
        contacts.iter().for_each(|c| borders.mark_farther_than(c))
    });
    let Borders { list, kept, .. } = borders;
    list.iter().filter(|b| b.nearer.load(Ordering::Relaxed) == Border::BOTH).for_each(|b| kept[b.contact] = false);
    let mut keep = kept.iter();
    contacts.retain(|_| *keep.next().unwrap_or(&true));
}

/// A contact between a vertex and an edge or another vertex.
struct Border {
    /// The vertex and the ends of the edge, in order; or both vertices in order and [`u32::MAX`].
    key: [u32; 3],
    contact: usize,
    /// Unit normal, towards the first vertex of the key.
    normal: Vec3,
    /// Gap of the contact at the start `[m]`.
    gap: f64,
    /// Bits: whether a face is nearer to the first vertex of the key, and to the second.
    nearer: AtomicU8,
}

impl Border {
    /// A face is nearer to both vertices of the key.
    const BOTH: u8 = 3;

    /// The border that the closest points of a contact lie on; `None` inside a face or where two edges cross.
    fn of(contact: &Contact, index: usize) -> Option<Border> {
        let (mut ends, mut counts) = ([[u32::MAX; 3]; 2], [0; 2]);
        for k in 0..4 {
            if contact.weights[k] != 0.0 {
                let side = usize::from(contact.on_second(k));
                ends[side][counts[side].min(2)] = contact.vertices[k];
                counts[side] += 1;
            }
        }
        let [a, b] = ends;
        let ordered = |first: u32, e: [u32; 3]| [first, e[0].min(e[1]), e[0].max(e[1])];
        let (key, nearer) = match counts {
            [1, 1] => ([a[0].min(b[0]), a[0].max(b[0]), u32::MAX], 0),
            [1, 2] => (ordered(a[0], b), 2),
            [2, 1] => (ordered(b[0], a), 2),
            _ => return None,
        };
        let forwards = key[0] == a[0] && counts[0] == 1;
        let normal = if forwards { contact.normal } else { scale(-1.0, contact.normal) };
        Some(Border { key, contact: index, normal, gap: contact.start_gap, nearer: AtomicU8::new(nearer) })
    }
}

/// Borders by key, of the contacts of one list. Several may have the same one.
#[derive(Default)]
pub(super) struct Borders {
    list: Vec<Border>,
    /// Numbers in the list, by hash and then in the order of insertion; [`EMPTY`] behind the last of each.
    slots: Vec<u32>,
    /// Which contacts stay.
    kept: Vec<bool>,
}

const EMPTY: u32 = u32::MAX;

impl Borders {
    /// No border yet, and room for those of so many contacts, which all stay so far.
    fn empty(&mut self, count: usize) {
        self.list.clear();
        self.slots.clear();
        self.slots.resize((count + count / 2 + 2).next_power_of_two(), EMPTY);
        self.kept.clear();
        self.kept.resize(count, true);
    }

    /// The slots of a key and what follows them, from its hash on.
    fn slots_of(&self, key: [u32; 3]) -> impl Iterator<Item = usize> + use<> {
        let mixed =
            key.iter().fold(0_u64, |h, k| (h ^ u64::from(*k)).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29));
        let mask = self.slots.len() - 1;
        (0..).map(move |step: usize| (mixed as usize).wrapping_add(step) & mask)
    }

    /// The borders with a key, in the order of insertion.
    fn with_key(&self, key: [u32; 3]) -> impl Iterator<Item = &Border> {
        let used = self.slots_of(key).map(|slot| self.slots[slot]).take_while(|number| *number != EMPTY);
        used.map(|number| &self.list[number as usize]).filter(move |border| border.key == key)
    }

    fn insert(&mut self, border: Border) {
        if let Some(free) = self.slots_of(border.key).find(|slot| self.slots[*slot] == EMPTY) {
            self.slots[free] = self.list.len() as u32;
            self.list.push(border);
        }
    }

    /// Marks the borders of the face of a vertex-face contact that are farther from its vertex than the face is.
    fn mark_farther_than(&self, contact: &Contact) {
        let [p, face @ ..] = contact.vertices;
        for k in 0..3 {
            let (v, w) = (face[k], face[(k + 1) % 3]);
            for (key, bit) in
                [([p, v.min(w), v.max(w)], 1), ([p.min(v), p.max(v), u32::MAX], if p > v { 2 } else { 1 })]
            {
                for border in self.with_key(key).filter(|border| contact.start_gap < border.gap) {
                    border.nearer.fetch_or(bit, Ordering::Relaxed);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::pair::Pair;
    use super::*;
    use crate::math::random::Random;

    /// Vertices that count on each side, sorted.
    fn sides(c: &Contact) -> [Vec<u32>; 2] {
        let mut out = [false, true].map(|second| {
            let own = (0..4).filter(|k| c.weights[*k] != 0.0 && c.on_second(*k) == second);
            own.map(|k| c.vertices[k]).collect::<Vec<u32>>()
        });
        out.iter_mut().for_each(|side| side.sort_unstable());
        out
    }

    /// The rule as it is told, each contact against each.
    fn by_brute_force(contacts: &[Contact]) -> Vec<Contact> {
        let is_border = |[a, b]: &[Vec<u32>; 2]| a.len() + b.len() <= 3;
        let mut kept: Vec<Contact> = Vec::new();
        for c in contacts {
            let [a, b] = sides(c);
            let same = kept.iter_mut().rev().find_map(|k| {
                let [p, q] = sides(k);
                let turned = if p == a && q == b { 1.0 } else { -1.0 };
                ((p == a && q == b) || (p == b && q == a)).then_some((turned, k))
            });
            match same.filter(|_| is_border(&[a, b])) {
                Some((turned, k)) if turned * dot(k.normal, c.normal) > 0.5 => {
                    k.thickness = k.thickness.max(c.thickness);
                }
                _ => kept.push(*c),
            }
        }
        // Whether a face at the border is nearer to its only vertex on one side.
        let nearer = |c: &Contact, from: &[u32], border: &[u32]| {
            let of_vertex = contacts.iter().filter(|f| f.pair.kind == PairKind::VertexFace && from == &f.vertices[..1]);
            of_vertex.filter(|f| f.start_gap < c.start_gap).any(|f| border.iter().all(|v| f.vertices[1..].contains(v)))
        };
        kept.retain(|c| {
            let [a, b] = sides(c);
            let slides = |from: &[u32], border: &[u32]| from.len() == 2 || nearer(c, from, border);
            !(is_border(&[a.clone(), b.clone()]) && slides(&a, &b) && slides(&b, &a))
        });
        kept
    }

    #[test]
    fn same_contacts_as_by_brute_force() {
        let mut random = Random(1);
        let mut pick = |n: u64| random.below(n);
        let (mut shorter, mut borders) = (0, Borders::default());
        for round in 0..300 {
            // Few vertices, so that borders are shared and nearly every slot of the table is asked for.
            let vertices = 5 + round % 9;
            let mut contacts: Vec<Contact> = (0..3 + round % 40)
                .map(|i| {
                    let kind = if pick(2) == 0 { PairKind::VertexFace } else { PairKind::EdgeEdge };
                    let mut named = Vec::new();
                    while named.len() < 4 {
                        let v = pick(vertices) as u32;
                        if !named.contains(&v) {
                            named.push(v);
                        }
                    }
                    let first = if kind == PairKind::VertexFace { 1 } else { 2 };
                    let mut weights = [0.0; 4];
                    // One vertex of each side counts at least.
                    weights[pick(first) as usize] = 1.0;
                    weights[first as usize + pick(4 - first) as usize] = -1.0;
                    weights.iter_mut().filter(|w| **w == 0.0).for_each(|w| *w = [0.0, 0.0, 0.5][pick(3) as usize]);
                    Contact {
                        pair: Pair { kind, features: [i as u32, 0] },
                        ordinal: 0,
                        vertices: [named[0], named[1], named[2], named[3]],
                        weights,
                        normal: [0.0, 0.0, [1.0, -1.0][pick(2) as usize]],
                        offset: 0.0,
                        thickness: pick(5) as f64,
                        start_gap: pick(5) as f64,
                    }
                })
                .collect();
            contacts.sort_by_key(|c| c.pair);
            let (expected, all) = (by_brute_force(&contacts), contacts.len());
            distinct(&mut contacts, &mut borders, Par::Serial);
            assert_eq!(contacts, expected, "round {round}");
            shorter += usize::from(contacts.len() < all);
        }
        assert!(shorter > 150, "{shorter}");
    }
}
