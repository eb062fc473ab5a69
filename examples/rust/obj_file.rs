//! Triangle meshes of OBJ files.

use signorini::math::Vec3;

/// What of an OBJ file is geometry.
#[derive(Clone, Debug, Default)]
pub struct Obj {
    pub positions: Vec<Vec3>,
    pub faces: Vec<[u32; 3]>,
    /// Line of each face, from 1.
    pub face_lines: Vec<usize>,
    /// Name and first vertex of each `o`; vertices before the first belong to none.
    pub objects: Vec<(String, usize)>,
}

/// Reads vertices, faces and objects; polygons are cut into fans, everything else is passed over.
///
/// Errors: line number (from 1) and what is wrong there.
pub fn parse(text: &str) -> Result<Obj, (usize, String)> {
    let mut obj = Obj::default();
    for (index, line) in text.lines().enumerate() {
        let fail = |message: String| (index + 1, message);
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                let mut x = [0.0; 3];
                for coordinate in &mut x {
                    let word = words.next().ok_or_else(|| fail("a vertex needs three coordinates".to_string()))?;
                    *coordinate = word.parse().map_err(|_| fail(format!("'{word}' is not a number")))?;
                }
                obj.positions.push(x);
            }
            Some("f") => {
                let corners = words.map(|word| corner(word, obj.positions.len())).collect::<Result<Vec<u32>, String>>();
                let corners = corners.map_err(fail)?;
                if corners.len() < 3 {
                    return Err(fail("a face needs three vertices".to_string()));
                }
                for k in 2..corners.len() {
                    obj.faces.push([corners[0], corners[k - 1], corners[k]]);
                    obj.face_lines.push(index + 1);
                }
            }
            Some("o") => obj.objects.push((line.trim()[1..].trim().to_string(), obj.positions.len())),
            _ => {}
        }
    }
    Ok(obj)
}

/// Vertex index of a face corner `v`, `v/t` or `v/t/n`, counted from 1, or backwards from -1.
fn corner(word: &str, count: usize) -> Result<u32, String> {
    let number = word.split('/').next().unwrap_or(word);
    let value: i64 = number.parse().map_err(|_| format!("'{word}' is not a vertex"))?;
    let index = if value < 0 { value + count as i64 } else { value - 1 };
    u32::try_from(index).map_err(|_| format!("'{word}' is not a vertex"))
}
