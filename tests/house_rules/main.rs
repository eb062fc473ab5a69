//! Rules that the compiler does not keep: layers, names that may not appear, file sizes, documents that match the tree.
//!
//! Every rule is a function of text, and is tried on a text that breaks it.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod layers;
mod text;

use std::path::{Path, PathBuf};

/// A source or document file of the repository.
pub struct File {
    /// Path from the top of the repository.
    pub path: String,
    /// Content.
    pub text: String,
}

fn top() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn collect(folder: &Path, extensions: &[&str], out: &mut Vec<File>) {
    let mut entries: Vec<PathBuf> = match std::fs::read_dir(folder) {
        Ok(entries) => entries.filter_map(|e| e.ok().map(|e| e.path())).collect(),
        Err(_) => return,
    };
    entries.sort();
    for path in entries {
        let name = path.file_name().and_then(|n| n.to_str()).unwrap_or_default().to_string();
        if name == ".git" {
            continue;
        }
        if path.is_dir() {
            if !matches!(name.as_str(), "target" | "out" | "data" | ".venv") {
                collect(&path, extensions, out);
            }
        } else if (extensions.is_empty() || extensions.iter().any(|e| name.ends_with(e)))
            && let Ok(text) = std::fs::read_to_string(&path)
        {
            let path = path.strip_prefix(top()).expect("below the top").to_string_lossy().into_owned();
            out.push(File { path, text });
        }
    }
}

/// All Rust files below `src`.
pub fn sources() -> Vec<File> {
    let mut files = Vec::new();
    collect(&top().join("src"), &[".rs"], &mut files);
    assert!(files.len() > 10, "no sources found");
    files
}

/// All program text outside `src`: tests, benches, examples, bindings, scripts.
fn other_programs() -> Vec<File> {
    let endings = [".rs", ".c", ".h", ".cpp", ".hpp", ".py", ".sh"];
    let mut files = Vec::new();
    for folder in ["tests", "benches", "examples", "bindings", "ci"] {
        let before = files.len();
        collect(&top().join(folder), &endings, &mut files);
        assert!(files.len() > before, "no programs in {folder}");
    }
    files
}

/// All text files of the repository that people write.
pub fn everything() -> Vec<File> {
    let mut files = Vec::new();
    collect(&top(), &[], &mut files);
    files
}

fn report(violations: Vec<String>) {
    assert!(violations.is_empty(), "\n{}\n", violations.join("\n"));
}

#[test]
fn modules_import_downwards_only() {
    report(sources().iter().flat_map(layers::violations).collect());
}

#[test]
fn every_module_has_a_layer_and_a_line_in_the_crate_map() {
    let root = std::fs::read_to_string(top().join("src/lib.rs")).expect("lib.rs");
    let modules: Vec<&str> =
        root.lines().filter_map(|l| l.strip_prefix("pub mod ").and_then(|l| l.strip_suffix(';'))).collect();
    assert!(modules.len() > 5);
    for module in modules {
        assert!(layers::layer(module).is_some(), "{module} has no layer");
        // A module behind a feature is not linked: the map is read without it, too.
        let listed = [format!("//! | [`{module}`] |"), format!("//! | `{module}` |")];
        assert!(listed.iter().any(|line| root.contains(line)), "{module} is missing in the map of src/lib.rs");
    }
}

#[test]
fn names_stay_in_their_rooms() {
    report(sources().iter().flat_map(text::forbidden_names).collect());
}

#[test]
fn files_keep_their_size() {
    report(sources().iter().chain(&other_programs()).filter_map(text::too_long).collect());
}

#[test]
fn no_vague_file_names() {
    report(sources().iter().filter_map(text::vague_name).collect());
}

#[test]
fn architecture_names_folders_that_exist() {
    let text = std::fs::read_to_string(top().join("ARCHITECTURE.md")).expect("ARCHITECTURE.md");
    let named = text::named_folders(&text);
    assert!(named.len() > 10, "ARCHITECTURE.md names the folders");
    report(
        named.into_iter().filter(|f| !top().join(f).is_dir()).map(|f| format!("ARCHITECTURE.md names {f}")).collect(),
    );
    let folders = std::fs::read_dir(top().join("src")).expect("src");
    for folder in folders.filter_map(|e| e.ok()).filter(|e| e.path().is_dir()) {
        let name = format!("src/{}/", folder.file_name().to_string_lossy());
        assert!(text.contains(&name), "ARCHITECTURE.md does not name {name}");
    }
}

#[test]
fn citations_resolve() {
    let bib = std::fs::read_to_string(top().join("docs/references.bib")).expect("docs/references.bib");
    let keys = text::bib_keys(&bib);
    assert!(keys.iter().any(|k| k == "Otaduy09"));
    report(
        everything()
            .iter()
            .filter(|f| f.path.starts_with("src/") || f.path.starts_with("docs/method"))
            .flat_map(|f| {
                text::citations(&f.text)
                    .into_iter()
                    .filter(|c| !keys.contains(c))
                    .map(|c| format!("{}: [{c}] is not in docs/references.bib", f.path))
                    .collect::<Vec<_>>()
            })
            .collect(),
    );
}

#[test]
fn the_repository_stands_alone() {
    let files = everything();
    assert!(files.iter().any(|f| f.path == "README.md"));
    report(files.iter().flat_map(text::foreign_paths).collect());
}

#[test]
fn the_readme_shows_the_smallest_host_as_it_is() {
    let readme = std::fs::read_to_string(top().join("README.md")).expect("README.md");
    let host = std::fs::read_to_string(top().join("examples/c/minimal.c")).expect("minimal.c");
    assert!(readme.contains(&format!("```c\n{host}```")), "README.md and examples/c/minimal.c differ");
}

#[test]
fn links_of_documents_lead_somewhere() {
    let documents: Vec<File> = everything().into_iter().filter(|f| f.path.ends_with(".md")).collect();
    assert!(documents.len() > 5);
    let mut dead = Vec::new();
    for file in &documents {
        let folder = top().join(&file.path).parent().expect("has a folder").to_path_buf();
        for link in text::links(&file.text) {
            if !folder.join(&link).exists() {
                dead.push(format!("{}: {link}", file.path));
            }
        }
    }
    report(dead);
}
