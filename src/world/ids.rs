//! Value ids: index, generation, kind and world tag in one number; nothing that is looked up by one can dangle.

use super::{Fault, WorldError};
use std::sync::atomic::{AtomicU32, Ordering};

/// Numbers worlds, so that an id of one world is refused by every other of the process. Carries no configuration.
static WORLDS_CREATED: AtomicU32 = AtomicU32::new(0);

/// What an id names; two bits of it, so that an id of one kind is refused where another is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum IdKind {
    /// A body.
    Body = 0,
    /// A material.
    Material = 1,
    /// A system.
    System = 2,
}

/// Tag of a new world: 14 bits, not 0. Repeats after 16383 worlds.
pub(super) fn new_world_tag() -> u16 {
    (WORLDS_CREATED.fetch_add(1, Ordering::Relaxed) % 0x3fff) as u16 + 1
}

/// Bits of an id that name its slot and generation; what is left is the tag and the kind. Also the model's key.
const KEY_MASK: u64 = 0xffff_ffff_ffff;

struct Slot<T> {
    /// Generation of the value, or of the one that was removed last.
    generation: u16,
    /// The highest generation ever given out. Above `generation` only after an older table was restored.
    given: u16,
    value: Option<T>,
}

/// Values by id. Slots are used again under a new generation; a slot whose generations are used up is retired.
pub(super) struct Slots<T> {
    prefix: u64,
    entries: Vec<Slot<T>>,
    free: Vec<u32>,
}

impl<T> Slots<T> {
    pub(super) fn new(tag: u16, kind: IdKind) -> Slots<T> {
        let prefix = (((tag as u64) << 2) | kind as u64) << 48;
        Slots { prefix, entries: Vec::new(), free: Vec::new() }
    }

    /// Stores what `make` returns for the new id.
    pub(super) fn insert_with(&mut self, make: impl FnOnce(u64) -> Result<T, WorldError>) -> Result<u64, WorldError> {
        if let Some(&index) = self.free.last() {
            let generation = self.entries[index as usize].given + 1;
            let id = self.id(index, generation);
            let value = Some(make(id)?);
            self.entries[index as usize] = Slot { generation, given: generation, value };
            self.free.pop();
            return Ok(id);
        }
        let index = self.entries.len();
        if index >= u32::MAX as usize - 1 || self.entries.try_reserve(1).is_err() {
            return Err(WorldError::out_of_memory("the table of ids cannot grow"));
        }
        let id = self.id(index as u32, 1);
        let value = Some(make(id)?);
        self.entries.push(Slot { generation: 1, given: 1, value });
        Ok(id)
    }

    fn id(&self, index: u32, generation: u16) -> u64 {
        self.prefix | ((generation as u64) << 32) | (index as u64 + 1)
    }

    /// The id of a key that the model uses.
    pub(super) fn id_of_key(&self, key: u64) -> u64 {
        self.prefix | key
    }

    /// Where the value of `id` stands. Errors: `InvalidId` for null, foreign and garbage ids, `StaleId` for removed ones.
    fn slot(&self, id: u64) -> Result<usize, WorldError> {
        let index = id as u32 as usize;
        let generation = (id >> 32) as u16;
        if id & !KEY_MASK != self.prefix || index == 0 || index > self.entries.len() || generation == 0 {
            let what = if id == 0 { "the id is null" } else { "the id is not one of this world and kind" };
            return Err(WorldError::new(Fault::InvalidId, what).object(id));
        }
        let slot = &self.entries[index - 1];
        if generation > slot.given {
            return Err(WorldError::new(Fault::InvalidId, "the id was never given out").object(id));
        }
        if generation != slot.generation || slot.value.is_none() {
            return Err(WorldError::new(Fault::StaleId, "what the id named has been removed").object(id));
        }
        Ok(index - 1)
    }

    pub(super) fn get(&self, id: u64) -> Result<&T, WorldError> {
        let slot = self.slot(id)?;
        self.entries[slot]
            .value
            .as_ref()
            .ok_or_else(|| WorldError::new(Fault::StaleId, "what the id named has been removed").object(id))
    }

    pub(super) fn get_mut(&mut self, id: u64) -> Result<&mut T, WorldError> {
        let slot = self.slot(id)?;
        self.entries[slot]
            .value
            .as_mut()
            .ok_or_else(|| WorldError::new(Fault::StaleId, "what the id named has been removed").object(id))
    }

    pub(super) fn remove(&mut self, id: u64) -> Result<(), WorldError> {
        let slot = self.slot(id)?;
        if self.free.try_reserve(1).is_err() {
            return Err(WorldError::out_of_memory("the table of ids cannot grow"));
        }
        let entry = &mut self.entries[slot];
        entry.value = None;
        if entry.given < u16::MAX {
            self.free.push(slot as u32);
        }
        Ok(())
    }

    /// The table without its values: generation of each slot and whether it is in use, and the free slots in order.
    pub(super) fn table(&self) -> (Vec<(u16, bool)>, Vec<u32>) {
        let used = |slot: &Slot<T>| (slot.generation, slot.value.is_some());
        (self.entries.iter().map(used).collect(), self.free.clone())
    }

    /// A table with the slots and values of a snapshot and the tag of this one. Ids that are valid in the snapshot are
    /// valid in it; ids that this table gave out since are stale, and are not given out again.
    ///
    /// Errors, as a message: slots that do not fit together.
    pub(super) fn restored(
        &self,
        slots: &[(u16, bool)],
        free: &[u32],
        values: impl IntoIterator<Item = T>,
    ) -> Result<Slots<T>, &'static str> {
        let count = slots.len().max(self.entries.len());
        let mut entries = Vec::new();
        let mut all_free: Vec<u32> = Vec::new();
        if entries.try_reserve(count).is_err() || all_free.try_reserve(count).is_err() {
            return Err("no memory for the table of ids");
        }
        let mut values = values.into_iter();
        for index in 0..count {
            let (generation, used) = slots.get(index).copied().unwrap_or((0, false));
            let value = if used { Some(values.next().ok_or("fewer values than slots in use")?) } else { None };
            if index < slots.len() && generation == 0 {
                return Err("a slot has the generation 0");
            }
            let given = self.entries.get(index).map_or(0, |now| now.given).max(generation);
            entries.push(Slot { generation, given, value });
        }
        if values.next().is_some() {
            return Err("more values than slots in use");
        }
        // Slots that the snapshot does not know come below its own: they are used again last.
        all_free.extend((slots.len()..count).rev().map(|index| index as u32));
        all_free.extend(free);
        let mut seen = vec![false; count];
        for index in &all_free {
            let slot = entries.get(*index as usize).ok_or("a free slot is out of range")?;
            if slot.value.is_some() || std::mem::replace(&mut seen[*index as usize], true) {
                return Err("a free slot is in use, or free twice");
            }
        }
        all_free.retain(|index| entries[*index as usize].given < u16::MAX);
        Ok(Slots { prefix: self.prefix, entries, free: all_free })
    }

    /// The key of an id that is in use; null stays null. Errors: those of a look-up.
    pub(super) fn key_of(&self, id: u64) -> Result<u64, WorldError> {
        if id == 0 { Ok(0) } else { self.slot(id).map(|_| key(id)) }
    }

    /// Ids and values in the order of slots.
    pub(super) fn iter(&self) -> impl Iterator<Item = (u64, &T)> {
        self.entries.iter().enumerate().filter_map(|(index, slot)| {
            slot.value.as_ref().map(|value| (self.id(index as u32, slot.generation), value))
        })
    }
}

/// The model's key of an id: unique within a world and the same from run to run.
pub(super) fn key(id: u64) -> u64 {
    id & KEY_MASK
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fault<T>(result: Result<T, WorldError>) -> Option<Fault> {
        result.err().map(|error| error.fault)
    }

    #[test]
    fn stale_foreign_and_garbage_ids_are_told_apart() {
        let mut a = Slots::new(1, IdKind::Body);
        let b: Slots<u32> = Slots::new(2, IdKind::Body);
        let c: Slots<u32> = Slots::new(1, IdKind::System);
        let first = a.insert_with(|_| Ok(7u32)).unwrap();
        let second = a.insert_with(|_| Ok(8u32)).unwrap();
        assert_eq!(a.get(first), Ok(&7));
        assert_eq!(fault(b.get(first)), Some(Fault::InvalidId));
        assert_eq!(fault(c.get(first)), Some(Fault::InvalidId));
        assert_eq!(fault(a.get(0)), Some(Fault::InvalidId));
        assert_eq!(fault(a.get(second + 1)), Some(Fault::InvalidId));
        assert_eq!(fault(a.get(second + (1 << 32))), Some(Fault::InvalidId));
        a.remove(first).unwrap();
        assert_eq!(fault(a.get(first)), Some(Fault::StaleId));
        assert_eq!(fault(a.remove(first)), Some(Fault::StaleId));
        let third = a.insert_with(|_| Ok(9u32)).unwrap();
        assert_ne!(third, first, "the slot is used again under a new generation");
        assert_eq!(fault(a.get(first)), Some(Fault::StaleId));
        assert_eq!(a.get(third), Ok(&9));
        assert_eq!(a.iter().map(|(id, _)| id).collect::<Vec<_>>(), [third, second]);
    }

    #[test]
    fn a_slot_is_retired_when_its_generations_are_used_up() {
        let mut slots = Slots::new(1, IdKind::Material);
        let mut seen = std::collections::BTreeSet::new();
        for _ in 0..70_000 {
            let id = slots.insert_with(|_| Ok(())).unwrap();
            assert!(seen.insert(id), "an id was given out twice");
            slots.remove(id).unwrap();
        }
    }

    #[test]
    fn a_value_that_cannot_be_made_uses_no_id() {
        let mut slots: Slots<u32> = Slots::new(1, IdKind::Body);
        assert!(slots.insert_with(|_| Err(WorldError::out_of_memory("no"))).is_err());
        assert_eq!(slots.iter().count(), 0);
        assert_eq!(slots.insert_with(|_| Ok(1)).unwrap() as u32, 1);
    }
}
