//! Rules on the text of single files.

use crate::File;

/// Lines of code at most: past this a file is two nouns.
const LINES_MAX: usize = 700;

/// Name, rooms in which it may appear (path prefixes), why.
const ROOMS: &[(&str, &[&str], &str)] = &[
    ("rayon", &["src/parallel/"], "parallel is the only module that names rayon"),
    ("parry", &["src/mesh/shape"], "parry types stay in mesh/shape"),
    ("glam", &["src/mesh/shape"], "glam types stay in mesh/shape"),
    ("unsafe", &["src/capi/", "src/math/simd", "src/parallel/"], "unsafe only in capi, math/simd and parallel"),
    ("HashMap", &[], "iteration order differs from run to run: use a sorted vector or a BTreeMap"),
    ("HashSet", &[], "iteration order differs from run to run: use a sorted vector or a BTreeSet"),
    ("mul_add", &[], "a fused multiply-add changes bits between machines"),
    ("println", &["src/bin/"], "the library never prints"),
    ("eprintln", &["src/bin/"], "the library never prints"),
    ("dbg", &[], "the library never prints"),
    ("std::process", &["src/bin/"], "the library never exits or aborts"),
    ("std::env", &[], "the library reads no environment"),
    ("std::fs", &["src/scene/"], "the library opens no files, but for the runner"),
    ("todo", &[], "left open"),
    ("unimplemented", &[], "left open"),
];

fn words(line: &str) -> impl Iterator<Item = &str> {
    line.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|w| !w.is_empty())
}

/// Code of a line: without its comment and without string literals.
fn code(line: &str) -> String {
    let line = line.split("//").next().unwrap_or_default();
    line.split('"').step_by(2).collect::<Vec<_>>().join(" ")
}

/// Names outside their rooms.
pub fn forbidden_names(file: &File) -> Vec<String> {
    let mut found = Vec::new();
    for (number, line) in file.text.lines().enumerate() {
        let code = code(line);
        for (name, rooms, why) in ROOMS {
            let path = name.contains("::") && code.contains(name);
            for _ in words(&code)
                .filter(|w| w == name || (*name == "parry" && w.starts_with("parry")))
                .chain(path.then_some(*name))
            {
                if !rooms.iter().any(|room| file.path.starts_with(room)) {
                    found.push(format!("{}:{}: {name}: {why}", file.path, number + 1));
                }
            }
        }
    }
    found
}

/// A file over the limit.
pub fn too_long(file: &File) -> Option<String> {
    let lines = file.text.lines().count();
    (lines > LINES_MAX).then(|| format!("{}: {lines} lines, more than {LINES_MAX}", file.path))
}

/// A file whose name is no noun of the field.
pub fn vague_name(file: &File) -> Option<String> {
    let parts = file.path.trim_end_matches(".rs").split('/');
    parts
        .filter(|p| matches!(*p, "utils" | "util" | "common" | "helpers" | "helper" | "misc" | "types"))
        .map(|p| format!("{}: {p} says nothing", file.path))
        .next()
}

/// Folders that a document names between backticks, with a slash at the end.
pub fn named_folders(text: &str) -> Vec<String> {
    text.split('`').skip(1).step_by(2).filter(|s| s.ends_with('/') && !s.contains(' ')).map(String::from).collect()
}

/// Targets of the links of a Markdown text that stay in the repository.
pub fn links(text: &str) -> Vec<String> {
    text.split("](")
        .skip(1)
        .filter_map(|rest| rest.split(')').next())
        .map(|target| target.split('#').next().unwrap_or_default().to_string())
        .filter(|target| !target.is_empty() && !target.contains("://"))
        .collect()
}

/// Keys of a bibliography.
pub fn bib_keys(text: &str) -> Vec<String> {
    text.lines()
        .filter(|l| l.starts_with('@'))
        .filter_map(|l| l.split('{').nth(1))
        .map(|k| k.trim_end_matches(',').trim().to_string())
        .collect()
}

/// Citations such as the key of `[Name09, Eq. 7]`: a capital, letters, two digits.
pub fn citations(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    for part in text.split('[').skip(1) {
        let key: String = part.chars().take_while(|c| c.is_ascii_alphanumeric()).collect();
        let letters = key.trim_end_matches(|c: char| c.is_ascii_digit());
        let digits = key.len() - letters.len();
        let next = part[key.len()..].chars().next();
        if digits == 2
            && letters.len() >= 3
            && letters.starts_with(|c: char| c.is_ascii_uppercase())
            && letters.chars().all(|c| c.is_ascii_alphabetic())
            && matches!(next, Some(',' | ']' | ';'))
        {
            found.push(key);
        }
    }
    found
}

/// Paths of a machine that only its owner has.
pub fn foreign_paths(file: &File) -> Vec<String> {
    let machine = [["/wo", "rk/"].concat(), ["/tm", "p/"].concat(), ["/ho", "me/"].concat(), ["/ro", "ot/"].concat()];
    let mut found = Vec::new();
    for (number, line) in file.text.lines().enumerate() {
        for path in &machine {
            let named = line.match_indices(path.as_str()).any(|(at, _)| {
                // Part of a longer path or of a variable is another matter.
                !line[..at].ends_with(|c: char| c.is_alphanumeric() || matches!(c, '.' | '}' | '_' | '-' | ')'))
            });
            if named {
                found.push(format!("{}:{}: names {path}", file.path, number + 1));
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(path: &str, text: &str) -> File {
        File { path: path.into(), text: text.into() }
    }

    #[test]
    fn finds_names_outside_their_rooms() {
        for (path, text, count) in [
            ("src/world/step.rs", "use rayon::prelude::*;", 1),
            ("src/parallel/mod.rs", "use rayon::prelude::*;", 0),
            ("src/world/step.rs", "// rayon is not named here", 0),
            ("src/world/step.rs", "let s = \"unsafe\";", 0),
            ("src/world/step.rs", "unsafe { f() }", 1),
            ("src/mesh/shape.rs", "use parry3d_f64::shape;", 0),
            ("src/mesh/validate.rs", "use parry3d_f64::shape;", 1),
            ("src/world/ids.rs", "let m: HashMap<u64, u32>;", 1),
            ("src/world/ids.rs", "println!(\"x\"); a.mul_add(b, c); std::process::exit(1);", 3),
        ] {
            assert_eq!(forbidden_names(&file(path, text)).len(), count, "{path} {text}");
        }
    }

    #[test]
    fn finds_long_files_and_vague_names() {
        assert!(too_long(&file("src/a.rs", &"x\n".repeat(LINES_MAX + 1))).is_some());
        assert!(too_long(&file("src/a.rs", &"x\n".repeat(LINES_MAX))).is_none());
        assert!(vague_name(&file("src/mesh/utils.rs", "")).is_some());
        assert!(vague_name(&file("src/mesh/shape.rs", "")).is_none());
    }

    #[test]
    fn reads_folders_keys_and_citations() {
        assert_eq!(named_folders("`src/mesh/` holds `x`, `docs/`"), ["src/mesh/", "docs/"]);
        assert_eq!(links("[a](docs/b.md#c), [d](https://e.f) and [g](#h)"), ["docs/b.md"]);
        assert_eq!(bib_keys("@article{Otaduy09,\n title={a}"), ["Otaduy09"]);
        assert_eq!(
            citations("see [Otaduy09, Eq. 7] and [Provot97] not [m/s] [u32; 2] or a[Index12x]"),
            ["Otaduy09", "Provot97"]
        );
    }

    #[test]
    fn finds_paths_of_one_machine() {
        let path = ["/wo", "rk/thing"].concat();
        assert_eq!(foreign_paths(&file("README.md", &format!("see {path}"))).len(), 1);
        assert_eq!(foreign_paths(&file("README.md", &format!("see target{path}"))).len(), 0);
    }
}
