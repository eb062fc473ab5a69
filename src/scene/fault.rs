//! What is wrong with a scene file, and where.

use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A fault with its file, line and field.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneFault {
    /// File as it was named.
    pub file: String,
    /// Line, from 1; 0 for the file as a whole.
    pub line: usize,
    /// Field as a path, like `sheet[0].material.density`; empty for the file as a whole.
    pub field: String,
    /// What is wrong.
    pub message: String,
}

impl std::fmt::Display for SceneFault {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{}", self.file)?;
        if self.line > 0 {
            write!(f, ":{}", self.line)?;
        }
        if !self.field.is_empty() {
            write!(f, ": {}", self.field)?;
        }
        write!(f, ": {}", self.message)
    }
}

impl std::error::Error for SceneFault {}

/// A fault of a field, before its line is known.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FieldFault {
    /// Path from the top of the file, `.` between tables, `[i]` behind arrays.
    pub field: String,
    /// What is wrong.
    pub message: String,
}

impl FieldFault {
    /// A fault of `field`.
    pub fn new(field: impl Into<String>, message: impl Into<String>) -> FieldFault {
        FieldFault { field: field.into(), message: message.into() }
    }
}

/// The text of a scene file with the place of every field.
pub struct Places<'a> {
    file: &'a str,
    text: &'a str,
    table: Option<Spanned<DeTable<'a>>>,
}

impl<'a> Places<'a> {
    /// Places of a text; of one that is no TOML, only lines.
    pub fn new(file: &'a str, text: &'a str) -> Places<'a> {
        Places { file, text, table: DeTable::parse(text).ok() }
    }

    /// The fault of a field with the line where it, or else the nearest table around it, stands.
    pub fn fault(&self, fault: FieldFault) -> SceneFault {
        let line = self.table.as_ref().map_or(0, |table| {
            let mut at = table.span().start;
            let mut value: Option<&Spanned<DeValue>> = None;
            for (step, name) in fault.field.split(['.', '[']).enumerate() {
                let name = name.trim_end_matches(']');
                let next = match (value.map(|v| v.get_ref()), step) {
                    (None, 0) => table.get_ref().get_key_value(name).map(|(key, value)| (key.span().start, value)),
                    (Some(DeValue::Table(inner)), _) => {
                        inner.get_key_value(name).map(|(key, value)| (key.span().start, value))
                    }
                    (Some(DeValue::Array(inner)), _) => {
                        name.parse().ok().and_then(|i: usize| inner.get(i)).map(|value| (value.span().start, value))
                    }
                    _ => None,
                };
                let Some((start, inner)) = next else { break };
                (at, value) = (start, Some(inner));
            }
            self.line(at)
        });
        SceneFault { file: self.file.to_string(), line, field: fault.field, message: fault.message }
    }

    /// The fault that the parser found.
    pub fn parser_fault(&self, error: &toml::de::Error) -> SceneFault {
        let message = error.message().trim().replace('\n', "; ");
        let Some(span) = error.span() else {
            return SceneFault { file: self.file.to_string(), line: 0, field: String::new(), message };
        };
        let field = self.table.as_ref().map_or(String::new(), |table| path_to(table.get_ref(), span.start));
        SceneFault { file: self.file.to_string(), line: self.line(span.start), field, message }
    }

    fn line(&self, at: usize) -> usize {
        1 + self.text.as_bytes()[..at.min(self.text.len())].iter().filter(|b| **b == b'\n').count()
    }
}

/// Path of the innermost field whose key or value holds the byte `at`.
fn path_to(table: &DeTable, at: usize) -> String {
    for (key, value) in table.iter() {
        if key.span().contains(&at) {
            return key.get_ref().to_string();
        }
        if let Some(rest) = path_within(value, at) {
            return format!("{}{rest}", key.get_ref());
        }
    }
    String::new()
}

fn path_within(value: &Spanned<DeValue>, at: usize) -> Option<String> {
    match value.get_ref() {
        DeValue::Table(inner) => {
            let deeper = path_to(inner, at);
            if !deeper.is_empty() {
                return Some(format!(".{deeper}"));
            }
        }
        DeValue::Array(items) => {
            for (i, item) in items.iter().enumerate() {
                if let Some(rest) = path_within(item, at) {
                    return Some(format!("[{i}]{rest}"));
                }
            }
        }
        _ => {}
    }
    value.span().contains(&at).then(String::new)
}
