//! `include/signorini.h` is what cbindgen makes of `src/capi`, and the list of symbols names its functions.

use std::path::Path;

/// Files of `src/capi` in the order of the header.
const SOURCES: [&str; 16] = [
    "status",
    "version",
    "views",
    "context",
    "world",
    "material",
    "shape",
    "description",
    "body",
    "model",
    "drive",
    "system",
    "step",
    "query",
    "snapshot",
    "filter",
];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The header as it should be.
fn generated() -> String {
    let config = cbindgen::Config::from_file(root().join("cbindgen.toml")).expect("cbindgen.toml");
    let mut builder = cbindgen::Builder::new().with_config(config);
    for source in SOURCES.iter().chain(&["api"]) {
        builder = builder.with_src(root().join("src/capi").join(source).with_extension("rs"));
    }
    let mut bytes = Vec::new();
    builder.generate().expect("cbindgen").write(&mut bytes);
    let header = parenthesise_negative_constants(&String::from_utf8(bytes).expect("UTF-8"));
    guard_the_trailer(&header)
}

/// cbindgen puts the trailer after the end of the include guard.
fn guard_the_trailer(header: &str) -> String {
    let end = "#endif  /* SIGNORINI_H */\n";
    let (before, trailer) = header.split_once(end).expect("the end of the include guard");
    format!("{before}{}\n{end}", trailer.trim_start())
}

/// cbindgen writes `#define X -9`; in an expression that wants parentheses.
fn parenthesise_negative_constants(header: &str) -> String {
    let mut out = String::new();
    for line in header.lines() {
        match line.split_once(" -").filter(|(name, _)| name.starts_with("#define ")) {
            Some((name, number)) => out += &format!("{name} (-{number})\n"),
            None => out += &format!("{line}\n"),
        }
    }
    out
}

/// Names of the functions that a header declares, sorted.
pub fn functions(header: &str) -> Vec<String> {
    let mut names: Vec<String> = header
        .lines()
        .filter_map(|line| line.strip_prefix("SGN_API ").unwrap_or(line).strip_prefix("SgnResult "))
        .filter_map(|line| Some(line.split_once('(')?.0.to_string()))
        .filter(|name| name.starts_with("sgn_"))
        .collect();
    names.sort();
    names
}

fn bless_or_compare(path: &str, wanted: &str) {
    let file = root().join(path);
    if std::env::var_os("SGN_BLESS").is_some() {
        std::fs::write(&file, wanted).expect("write");
        return;
    }
    let there = std::fs::read_to_string(&file).unwrap_or_default();
    if there != wanted {
        let line = there.lines().zip(wanted.lines()).position(|(a, b)| a != b).unwrap_or(0) + 1;
        panic!("{path} is not what src/capi makes of it, from line {line} on: run with SGN_BLESS=1");
    }
}

#[test]
fn the_header_is_generated_from_the_sources() {
    let header = generated();
    bless_or_compare("include/signorini.h", &header);
    let names = functions(&header);
    assert!(names.len() > 40, "{names:?}");
    for entry in std::fs::read_dir(root().join("src/capi")).expect("src/capi") {
        let text = std::fs::read_to_string(entry.expect("an entry").path()).expect("a source");
        for export in text.split("pub unsafe extern \"C\" fn ").skip(1) {
            let name = &export[..export.find('(').expect("its arguments")];
            assert!(names.iter().any(|known| known == name), "{name} is exported and not in the header");
        }
    }
    bless_or_compare("include/signorini.symbols", &(names.join("\n") + "\n"));
}

#[test]
fn every_function_says_its_threads_and_errors() {
    let header = generated();
    let mut silent = Vec::new();
    for name in functions(&header) {
        let declaration = header.find(&format!(" {name}(")).expect("a declaration");
        let comment = &header[header[..declaration].rfind("/**").expect("a comment")..declaration];
        let comment = comment.to_lowercase();
        if !comment.contains("thread") || !comment.contains("errors") {
            silent.push(name);
        }
    }
    assert!(silent.is_empty(), "{silent:?}");
}
