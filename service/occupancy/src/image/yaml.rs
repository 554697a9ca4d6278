//! The YAML beside a map image, as `map_server` reads and writes it.
//!
//! Of YAML only what such files hold is read: one key a line, scalars plain or quoted, the origin
//! as a flow sequence, comments. Unknown keys are ignored, as `map_server` does.

use std::str::FromStr;

use crate::raster::Raster;

/// What a map's YAML says of its image.
#[derive(Clone, Debug, PartialEq)]
pub struct MapYaml {
    /// Path of the image, relative to the YAML's own folder unless it begins with `/`.
    pub image: String,
    /// How greys become cells.
    pub mode: MapMode,
    /// Edge of a pixel, in metres; positive.
    pub resolution_m: f64,
    /// x, y (metres) and heading (radians, counter-clockwise) of the lower-left corner of the
    /// lower-left pixel in the map's frame.
    pub origin: [f64; 3],
    /// True if white means occupied.
    pub negate: bool,
    /// Occupied at and above this probability.
    pub occupied_thresh: f64,
    /// Free at and below this probability.
    pub free_thresh: f64,
}

/// How greys become cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MapMode {
    /// Free, occupied or unknown.
    Trinary,
    /// As trinary, and in between 0 to 100 by proportion.
    Scale,
    /// The grey is the cell.
    Raw,
}

/// Why a YAML does not describe a map.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum InvalidYaml {
    /// A key that must be there is missing.
    Missing(&'static str),
    /// A value is not what its key needs.
    Value {
        /// The key.
        key: &'static str,
        /// What stood there.
        value: String,
        /// What is needed.
        needed: &'static str,
    },
}

impl std::fmt::Display for InvalidYaml {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Missing(key) => write!(f, "the map's YAML has no `{key}`"),
            Self::Value { key, value, needed } => {
                write!(f, "`{key}: {value}` in the map's YAML; needed is {needed}")
            }
        }
    }
}

impl std::error::Error for InvalidYaml {}

/// The YAML for the image that [`pgm`](super::pgm()) writes: the saver's keys in the saver's
/// order, lengths in full precision (the saver cuts them after three decimals), and the thresholds
/// 0.65 and 0.196, which keep 254, 205 and 0 apart for every reader. `image_name` is a file name.
pub fn yaml(raster: &Raster, image_name: &str) -> String {
    let origin = raster.info.origin();
    format!(
        "image: {}\nmode: trinary\nresolution: {}\norigin: [{}, {}, 0]\nnegate: 0\n\
         occupied_thresh: 0.65\nfree_thresh: 0.196\n",
        scalar(image_name),
        raster.info.frame.resolution_m(),
        origin.x,
        origin.y,
    )
}

/// A string as YAML: plain where that is safe, else in double quotes.
fn scalar(text: &str) -> String {
    let is_plain = text.starts_with(|first: char| first.is_ascii_alphabetic())
        && text.chars().all(|c| c.is_ascii_alphanumeric() || "._-/".contains(c));
    if is_plain {
        return text.to_owned();
    }
    let escaped = |c: char| match c {
        '"' | '\\' => format!("\\{c}"),
        c if c.is_control() => format!("\\u{:04x}", u32::from(c)),
        c => c.to_string(),
    };
    format!("\"{}\"", text.chars().map(escaped).collect::<String>())
}

/// Reads the YAML of a map.
///
/// # Errors
/// [`InvalidYaml`] if a needed key is missing or its value is not what it must be.
pub fn read_yaml(text: &str) -> Result<MapYaml, InvalidYaml> {
    let image = required(text, "image")?;
    let resolution_m = number(text, "resolution")?;
    if resolution_m <= 0.0 {
        let value = resolution_m.to_string();
        return Err(InvalidYaml::Value { key: "resolution", value, needed: "above 0" });
    }
    Ok(MapYaml {
        image: checked("image", image, "the name of a file", |image| {
            (!image.is_empty()).then(|| image.clone())
        })?,
        mode: match value_of(text, "mode") {
            Some(mode) => checked("mode", mode, "trinary, scale or raw", |mode| map_mode(mode))?,
            None => MapMode::Trinary,
        },
        resolution_m,
        origin: checked("origin", required(text, "origin")?, "[x, y, yaw]", |list| pose(list))?,
        negate: checked("negate", required(text, "negate")?, "0 or 1", |flag| negate(flag))?,
        occupied_thresh: number(text, "occupied_thresh")?,
        free_thresh: number(text, "free_thresh")?,
    })
}

fn required(text: &str, key: &'static str) -> Result<String, InvalidYaml> {
    value_of(text, key).ok_or(InvalidYaml::Missing(key))
}

fn number(text: &str, key: &'static str) -> Result<f64, InvalidYaml> {
    checked(key, required(text, key)?, "a finite number", |value| finite(value))
}

fn checked<T>(
    key: &'static str,
    value: String,
    needed: &'static str,
    read: impl Fn(&String) -> Option<T>,
) -> Result<T, InvalidYaml> {
    read(&value).ok_or(InvalidYaml::Value { key, value, needed })
}

/// The value of a key at the top level, without quotes and comment.
fn value_of(text: &str, key: &str) -> Option<String> {
    let value =
        text.lines().find_map(|line| line.strip_prefix(key)?.trim_start().strip_prefix(':'));
    Some(unquoted(value?.trim()))
}

fn unquoted(value: &str) -> String {
    if let Some(rest) = value.strip_prefix('\'') {
        let end = rest.find('\'').unwrap_or(rest.len());
        return rest[..end].to_owned();
    }
    let Some(rest) = value.strip_prefix('"') else {
        let end = if value.starts_with('#') { Some(0) } else { value.find(" #") };
        return value[..end.unwrap_or(value.len())].trim_end().to_owned();
    };
    let mut text = String::new();
    let mut rest = rest.chars();
    while let Some(c) = rest.next().filter(|&c| c != '"') {
        text.extend(if c == '\\' { escaped(&mut rest) } else { Some(c) });
    }
    text
}

/// What stands for the characters after a backslash in double quotes.
fn escaped(rest: &mut std::str::Chars) -> Option<char> {
    match rest.next()? {
        'n' => Some('\n'),
        't' => Some('\t'),
        'u' => {
            let code: String = rest.take(4).collect();
            char::from_u32(u32::from_str_radix(&code, 16).ok()?)
        }
        other => Some(other),
    }
}

fn finite(value: &str) -> Option<f64> {
    f64::from_str(value.trim()).ok().filter(|number| number.is_finite())
}

fn map_mode(mode: &str) -> Option<MapMode> {
    match mode.to_ascii_lowercase().as_str() {
        "trinary" => Some(MapMode::Trinary),
        "scale" => Some(MapMode::Scale),
        "raw" => Some(MapMode::Raw),
        _ => None,
    }
}

fn pose(list: &str) -> Option<[f64; 3]> {
    let numbers = list.strip_prefix('[')?.strip_suffix(']')?.split(',').map(finite);
    numbers.collect::<Option<Vec<f64>>>()?.try_into().ok()
}

fn negate(flag: &str) -> Option<bool> {
    match flag.to_ascii_lowercase().as_str() {
        "true" | "yes" | "on" => Some(true),
        "false" | "no" | "off" => Some(false),
        number => i64::from_str(number).ok().map(|number| number != 0),
    }
}

#[cfg(test)]
mod tests {
    use super::super::picture::tests::drawn;
    use super::*;
    use proptest::prelude::*;

    const SAVED: &str = "image: a.pgm\nmode: trinary\nresolution: 0.05\norigin: [-10.0, 2.5, 0]\n\
                         negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";

    #[test]
    fn the_savers_keys_in_its_order() {
        assert_eq!(
            yaml(&drawn("#."), "office.pgm"),
            "image: office.pgm\nmode: trinary\nresolution: 0.05\n\
             origin: [-0.15000000000000002, 0.1, 0]\nnegate: 0\noccupied_thresh: 0.65\n\
             free_thresh: 0.196\n",
            "full precision"
        );
    }

    #[test]
    fn older_writers_are_read() {
        let text = "# a comment\n\nimage: \"test map.png\"\r\nresolution: 0.100000 # metres\n\
                    origin: [ 2.0, 3, 1e0 ]\nnegate: false\noccupied_thresh: 0.65\n\
                    free_thresh: 0.25\nmode: 'Scale'\nauthor: nobody\n";
        let map = read_yaml(text).expect("a map");
        assert_eq!(map.image, "test map.png", "quotes go");
        assert_eq!(map.mode, MapMode::Scale, "whatever the case");
        assert_eq!(map.origin, [2.0, 3.0, 1.0], "three numbers");
        assert!(!map.negate, "as a word");
        let without_mode = SAVED.replace("mode: trinary\n", "");
        let map = read_yaml(&without_mode).expect("a map");
        assert_eq!(map.mode, MapMode::Trinary, "by default");
    }

    #[test]
    fn says_what_is_wrong() {
        let message = |from: &str, to: &str| {
            read_yaml(&SAVED.replace(from, to)).expect_err("malformed").to_string()
        };
        assert_eq!(message("negate: 0\n", ""), "the map's YAML has no `negate`", "missing");
        assert_eq!(
            message("-10.0, 2.5, 0", "-10.0, 2.5"),
            "`origin: [-10.0, 2.5]` in the map's YAML; needed is [x, y, yaw]",
            "two numbers"
        );
        assert_eq!(
            message("0.05", "0"),
            "`resolution: 0` in the map's YAML; needed is above 0",
            "no length"
        );
        assert_eq!(
            message("trinary", "fancy"),
            "`mode: fancy` in the map's YAML; needed is trinary, scale or raw",
            "an unknown mode"
        );
        assert_eq!(
            message("0.65", "nan"),
            "`occupied_thresh: nan` in the map's YAML; needed is a finite number",
            "no number"
        );
    }

    proptest! {
        #[test]
        fn reads_what_it_wrote(image_name in "\\PC{1,20}|[\\x00-\\x7f]{1,8}") {
            let map = read_yaml(&yaml(&drawn("#."), &image_name)).expect("our own text");
            prop_assert_eq!(map.image, image_name);
            prop_assert_eq!(map.origin, [-0.150_000_000_000_000_02, 0.1, 0.0]);
            prop_assert_eq!(map.resolution_m, 0.05);
        }

        #[test]
        fn no_text_makes_it_panic(text in "((image|mode|origin|negate): ?[\\[\"'#\\\\0-9, ]{0,9}\n){0,9}") {
            let _ = read_yaml(&text);
        }
    }
}
