//! Every stored query with an exact answer: no miss, no false alarm, no time late or more than 1e-6 early.

#[path = "../../examples/rust/ccd_check/query_file.rs"]
mod query_file;

use signorini::detection::ccd;
use std::path::Path;

#[test]
fn stored_queries_have_their_exact_answers() {
    let dir = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/ccd");
    let (mut files, mut queries, mut hits) = (0, 0, 0);
    for entry in std::fs::read_dir(&dir).expect("the folder is there") {
        let path = entry.expect("an entry").path();
        if path.extension().is_none_or(|x| x != "ccdq") {
            continue;
        }
        let file = query_file::read(&path).expect("a query file");
        let detect = if file.edge_edge { ccd::edge_edge::time_of_impact } else { ccd::point_triangle::time_of_impact };
        let separated = if file.edge_edge {
            ccd::edge_edge::time_of_impact_with_separation
        } else {
            ccd::point_triangle::time_of_impact_with_separation
        };
        for (i, q) in file.queries.iter().enumerate() {
            let found = detect(&q.x0, &q.x1, 1.0);
            let at = format!("{}, query {i}: {found:?}, exact {}", path.display(), q.toi_lo);
            assert_eq!(found.is_some(), q.hit, "{at}");
            if let Some(t) = found {
                assert!(t <= q.toi_lo && t >= q.toi_lo - 1e-6, "{at}");
                // Contact up to a time is contact before it or at it.
                assert!(detect(&q.x0, &q.x1, t * 0.99).is_none() || t == 0.0 || t * 0.01 < 1e-6, "{at}: early stop");
                assert!(detect(&q.x0, &q.x1, (q.toi_lo + 1e-6).min(1.0)).is_some(), "{at}: late stop");
                // Any separation is met no later than contact.
                let size = q.x0.iter().flatten().fold(0.0, |m: f64, c| m.max(c.abs()));
                for s in [0.0, 1e-9 * size] {
                    let near = separated(&q.x0, &q.x1, s, 1.0);
                    assert!(near.is_some_and(|n| n <= q.toi_lo), "{at}: separation {s} missed: {near:?}");
                }
            }
            hits += usize::from(q.hit);
            queries += 1;
        }
        files += 1;
    }
    assert!(files >= 28 && queries >= 7000 && hits >= 1500, "{files} files, {queries} queries, {hits} hits");
}

#[test]
fn damaged_files_are_named_with_the_offset() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/ccd/unit-tests-ee.ccdq");
    let good = std::fs::read(source).expect("the file is there");
    let dir = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let check = |name: &str, bytes: &[u8], offset: &str| {
        let path = dir.join(name);
        std::fs::write(&path, bytes).expect("written");
        let message = query_file::read(&path).err().expect("an error");
        assert!(message.contains(name) && message.contains(offset), "{message}");
    };
    check("short.ccdq", &good[..10], "byte 10");
    check("cut.ccdq", &good[..1000], "byte 1000");
    check("magic.ccdq", b"PLY\nformat ascii 1.0\n", "byte 0");
    let mut bad = good.clone();
    bad[8] = 7;
    check("kind.ccdq", &bad, "byte 8");
    let mut bad = good.clone();
    bad[16 + 216 + 8..16 + 216 + 16].copy_from_slice(&f64::NAN.to_le_bytes());
    check("nan.ccdq", &bad, "byte 240");
    let mut bad = good;
    bad[16 + 209] = 9;
    check("answer.ccdq", &bad, "byte 225");
}
