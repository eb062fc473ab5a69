//! `ci/ccd-check DIR`

use super::{Answer, empty_folder, run};
use std::path::Path;

const HEADER: usize = 16;
const RECORD: usize = 216;
/// Within a record: the time of contact, the end of its interval, and the exact answer.
const TIME: usize = 192;
const HIT: usize = 209;

/// Runs the script on a file of stored queries after `change` has been at the record of its first hit or miss.
fn check(name: &str, hit: bool, change: impl Fn(&mut [u8])) -> Answer {
    let stored = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/ccd/unit-tests-vf.ccdq");
    let mut bytes = std::fs::read(stored).expect("the file is there");
    let mut records = bytes[HEADER..].chunks_exact_mut(RECORD);
    change(records.find(|r| (r[HIT] == 1) == hit).expect("such a query"));
    let folder = empty_folder(name);
    std::fs::write(folder.join("queries.ccdq"), bytes).expect("written");
    run("ccd-check", &folder, &["."])
}

/// Misses, alarms, late and early times of the one file.
fn faults(answer: &Answer) -> Vec<String> {
    let line = answer.out.lines().find(|l| l.starts_with("queries.ccdq")).expect("a line for the file");
    line.split_whitespace().skip(3).take(4).map(str::to_string).collect()
}

#[test]
fn exact_answers_pass() {
    let answer = check("ccd clean", true, |_| {});
    assert_eq!((answer.status, faults(&answer)), (0, ["0", "0", "0", "0"].map(String::from).to_vec()));
}

#[test]
fn a_miss_fails() {
    // A query without contact, labelled as one with contact at the end.
    let answer = check("ccd miss", false, |record| {
        record[HIT] = 1;
        record[TIME..TIME + 8].copy_from_slice(&1.0_f64.to_le_bytes());
        record[TIME + 8..TIME + 16].copy_from_slice(&1.0_f64.to_le_bytes());
    });
    assert_eq!((answer.status, faults(&answer)[0].as_str()), (1, "1"), "{}{}", answer.out, answer.errors);
}

#[test]
fn a_false_alarm_is_counted() {
    let answer = check("ccd alarm", true, |record| {
        record[HIT] = 0;
        record[TIME..TIME + 8].copy_from_slice(&f64::NAN.to_le_bytes());
        record[TIME + 8..TIME + 16].copy_from_slice(&f64::NAN.to_le_bytes());
    });
    assert_eq!((answer.status, faults(&answer)[1].as_str()), (0, "1"), "{}{}", answer.out, answer.errors);
}

#[test]
fn a_late_time_fails() {
    // A contact that is said to have come earlier than it does.
    let answer = check("ccd late", true, |record| record[TIME..TIME + 8].copy_from_slice(&0.0_f64.to_le_bytes()));
    assert_eq!((answer.status, faults(&answer)[2].as_str()), (1, "1"), "{}{}", answer.out, answer.errors);
}

#[test]
fn what_cannot_be_read_is_named() {
    let folder = empty_folder("ccd broken");
    std::fs::write(folder.join("queries.ccdq"), b"CCDQ").expect("written");
    let answer = run("ccd-check", &folder, &["."]);
    assert!(answer.status == 2 && answer.errors.contains("queries.ccdq"), "{}", answer.errors);
    assert_eq!(run("ccd-check", &empty_folder("ccd empty"), &["."]).status, 2);
    assert_eq!(run("ccd-check", &folder, &["missing"]).status, 2);
}
