//! Terms that come with the library: effects beyond the paper's, each declared by a file as a user's term is.
//!
//! They may give in another way what the built-in rules give, and read fields that the library finds at samples.

use std::sync::OnceLock;

use super::{Origin, register_from};

/// Files, by name, in the order of documentation.
const FILES: [(&str, &str); 2] = [
    ("sky", include_str!("../rules/term/sky.wgsl")),
    ("specular", include_str!("../rules/term/specular.wgsl")),
];

/// Effects that share light out before it is diffuse.
pub const LAYERED: [&str; 2] = ["directional_occlusion", "fresnel"];

/// Make the library's terms known to this process.
///
/// # Panics
/// When one of its own files does not fit its own rules, which every use would show.
pub fn register_all() {
    static DONE: OnceLock<()> = OnceLock::new();
    DONE.get_or_init(|| {
        for (name, text) in FILES {
            if let Err(error) = register_from(Origin::Library, name, text) {
                panic!("rules/term/{name}.wgsl, line {}: {error}", error.line);
            }
        }
    });
}
