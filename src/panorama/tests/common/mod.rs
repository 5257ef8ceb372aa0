//! The real data: pictures and panoramas that are too large for the project, and what else tests share.

use std::path::PathBuf;

use skinfit_panorama::picture::Picture;

/// The folder of the data; `None` where `SKINFIT_NO_DATA_TESTS` says to do without.
pub(crate) fn data() -> Option<PathBuf> {
    let folder = match std::env::var_os("SKINFIT_DATA") {
        Some(named) => PathBuf::from(named),
        None => PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"),
    };
    if folder.is_dir() {
        return Some(folder);
    }
    assert!(
        std::env::var_os("SKINFIT_NO_DATA_TESTS").is_some(),
        "{} is missing. SKINFIT_DATA names the folder of the data; SKINFIT_NO_DATA_TESTS=1 leaves these tests out.",
        folder.display()
    );
    println!("without data: nothing was checked");
    None
}

/// A panorama of the data.
pub(crate) fn panorama(file: &std::path::Path) -> Picture {
    let image = exr::prelude::read_first_rgba_layer_from_file(
        file,
        |size, _| Picture { width: size.0, height: size.1, texels: vec![[0.0; 3]; size.0 * size.1] },
        |picture, at, (r, g, b, _): (f32, f32, f32, f32)| {
            picture.texels[at.1 * picture.width + at.0] = [r, g, b];
        },
    );
    image.expect("an EXR file").layer_data.channel_data.pixels
}

/// The 8-bit code of light under sRGB's curve (IEC 61966-2-1).
pub(crate) fn srgb_code(light: f64) -> u16 {
    let light = light.clamp(0.0, 1.0);
    let code = if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 };
    (code * 255.0).round() as u16
}
