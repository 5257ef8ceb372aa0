//! Tests of files that say what their colours are: as files, through the readers of maps and targets.

use std::path::PathBuf;

use moxcms::ColorProfile;

use super::*;

/// Linear P3 (D65) to linear Rec.709, as CSS Color 4 has both to XYZ: rows.
const P3: [[f64; 3]; 3] =
    [[1.224_94, -0.224_94, 0.0], [-0.042_06, 1.042_06, 0.0], [-0.019_64, -0.078_64, 1.098_27]];
/// Black, white, the primaries, greys and others, in codes of 16 bits.
const CODES: [[u16; 3]; 8] = [
    [0, 0, 0],
    [65535, 65535, 65535],
    [65535, 0, 0],
    [0, 65535, 0],
    [0, 0, 65535],
    [32768, 32768, 32768],
    [257, 2570, 60000],
    [51400, 34695, 25700],
];

/// What a PNG file is to say.
#[derive(Clone, Default)]
struct Said {
    profile: Option<Vec<u8>>,
    /// Chunks of that name and content.
    chunks: Vec<([u8; 4], Vec<u8>)>,
}

impl Said {
    fn profile(profile: &ColorProfile) -> Self {
        Self { profile: Some(profile.encode().unwrap()), ..Self::default() }
    }

    fn chunk(mut self, name: [u8; 4], content: &[u8]) -> Self {
        self.chunks.push((name, content.to_vec()));
        self
    }

    fn words(self, name: [u8; 4], numbers: &[u32]) -> Self {
        let content: Vec<u8> = numbers.iter().flat_map(|number| number.to_be_bytes()).collect();
        self.chunk(name, &content)
    }
}

/// A row of the codes: 16 bits, or their upper 8.
fn png_of(said: &Said, color: png::ColorType, deep: bool) -> Vec<u8> {
    let mut info = png::Info::with_size(CODES.len() as u32, 1);
    info.color_type = color;
    info.bit_depth = if deep { png::BitDepth::Sixteen } else { png::BitDepth::Eight };
    info.icc_profile = said.profile.clone().map(Into::into);
    let mut bytes = Vec::new();
    let mut writer = png::Encoder::with_info(&mut bytes, info).unwrap().write_header().unwrap();
    for (name, content) in &said.chunks {
        writer.write_chunk(png::chunk::ChunkType(*name), content).unwrap();
    }
    let channels = if color == png::ColorType::Rgb { 3 } else { 1 };
    let codes = CODES.iter().flat_map(|rgb| rgb[..channels].to_vec());
    let row: Vec<u8> = if deep {
        codes.flat_map(u16::to_be_bytes).collect()
    } else {
        codes.map(|code| (code >> 8) as u8).collect()
    };
    writer.write_image_data(&row).unwrap();
    writer.finish().unwrap();
    bytes
}

/// A folder with a file.
fn file(name: &str, bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    (folder, path)
}

/// The colours that are read, and what is told.
fn colours(bytes: &[u8]) -> Result<(Vec<[f32; 3]>, Vec<String>), SceneError> {
    let (_folder, path) = file("face.png", bytes);
    let mut warnings = Vec::new();
    let map = color_map(&path, &mut warnings)?;
    Ok((map.texels, warnings.iter().map(ToString::to_string).collect()))
}

fn read_png(said: &Said, deep: bool) -> (Vec<[f32; 3]>, Vec<String>) {
    colours(&png_of(said, png::ColorType::Rgb, deep)).unwrap()
}

/// Both files are read alike, to the bit, and nothing is told.
fn same_as_plain(said: &Said) {
    for deep in [false, true] {
        let (texels, told) = read_png(said, deep);
        assert_eq!(told, [""; 0]);
        assert_eq!(texels, read_png(&Said::default(), deep).0);
    }
}

/// The colours are those of P3 with sRGB's curve.
fn check_p3(texels: &[[f32; 3]], tolerance: f64) {
    for (texel, codes) in texels.iter().zip(CODES) {
        let shares = codes.map(|code| srgb_decode(f64::from(code) / 65535.0));
        for (value, row) in texel.iter().zip(P3) {
            let want: f64 = (0..3).map(|i| row[i] * shares[i]).sum();
            assert!((f64::from(*value) - want).abs() < tolerance, "{codes:?}: {texel:?}, not {want}");
        }
    }
}

#[test]
fn display_p3_is_taken_to_rec709_by_its_profile_and_by_its_code_points() {
    let (texels, told) = read_png(&Said::profile(&ColorProfile::new_display_p3()), true);
    assert_eq!(told, [""; 0]);
    // A profile's numbers have 16 bits behind the point, and its white is D50 to four digits.
    check_p3(&texels, 5e-4);
    let (texels, told) = read_png(&Said::default().chunk(*b"cICP", &[12, 13, 0, 1]), true);
    assert_eq!(told, [""; 0]);
    // The published digits.
    check_p3(&texels, 2e-5);
}

#[test]
fn primaries_are_told_without_their_curve() {
    let read = |said: &Said| {
        let (_folder, path) = file("face.png", &png_of(said, png::ColorType::Rgb, false));
        to_rec709(&path, &mut Vec::new()).unwrap()
    };
    assert_eq!(read(&Said::default()), None);
    assert_eq!(read(&Said::default().words(*b"gAMA", &[100_000])), None);
    let rows = read(&Said::profile(&ColorProfile::new_display_p3())).unwrap().transpose().to_cols_array_2d();
    // As the colours are held to.
    assert!(rows.as_flattened().iter().zip(P3.as_flattened()).all(|(got, want)| (got - want).abs() < 5e-4));
}

#[test]
fn adobe_rgb_has_its_own_curve() {
    let (texels, _) = read_png(&Said::profile(&ColorProfile::new_adobe_rgb()), true);
    // Its red alone is 1.3984 of Rec.709's (Lindbloom's matrices, Bradford), and its curve 563/256.
    assert!((texels[2][0] - 1.3984).abs() < 1e-3, "{:?}", texels[2]);
    let grey = (32768.0_f64 / 65535.0).powf(563.0 / 256.0) as f32;
    assert!(texels[5].iter().all(|value| (value - grey).abs() < 1e-6), "{:?}, not {grey}", texels[5]);
}

#[test]
fn what_says_srgb_is_read_as_what_says_nothing() {
    same_as_plain(&Said::profile(&ColorProfile::new_srgb()));
    same_as_plain(&Said::default().chunk(*b"sRGB", &[0]));
    same_as_plain(&Said::default().chunk(*b"cICP", &[1, 13, 0, 1]));
    // As many programs write it beside or instead of sRGB.
    let rec709 = [31270, 32900, 64000, 33000, 30000, 60000, 15000, 6000];
    same_as_plain(&Said::default().words(*b"gAMA", &[45455]).words(*b"cHRM", &rec709));
    same_as_plain(&Said::default().words(*b"gAMA", &[45455]));
    // A table of 1024 points in 16 bits, as the commonest sRGB profile has it.
    let mut table = ColorProfile::new_srgb();
    let point = |i: u32| (srgb_decode(f64::from(i) / 1023.0) * 65535.0).round() as u16;
    let curve = moxcms::ToneReprCurve::Lut((0..1024).map(point).collect());
    (table.red_trc, table.green_trc, table.blue_trc) =
        (Some(curve.clone()), Some(curve.clone()), Some(curve));
    same_as_plain(&Said::profile(&table));
    // The power that is often taken for it is another curve.
    let mut power = ColorProfile::new_srgb();
    let curve = Some(moxcms::curve_from_gamma(2.2));
    (power.red_trc, power.green_trc, power.blue_trc) = (curve.clone(), curve.clone(), curve);
    let (texels, _) = read_png(&Said::profile(&power), true);
    assert!((f64::from(texels[6][0]) - (257.0_f64 / 65535.0).powf(2.2)).abs() < 1e-6, "{:?}", texels[6]);
}

#[test]
fn the_first_of_the_claims_counts() {
    let p3 = Said::profile(&ColorProfile::new_display_p3());
    same_as_plain(&p3.clone().chunk(*b"cICP", &[1, 13, 0, 1]));
    same_as_plain(&Said::default().words(*b"gAMA", &[100_000]).chunk(*b"sRGB", &[0]));
    let linear = p3.words(*b"gAMA", &[100_000]);
    check_p3(&read_png(&linear, true).0, 5e-4);
    // What cannot be followed is told, and the next one counts.
    let (texels, told) = read_png(&linear.chunk(*b"cICP", &[2, 2, 0, 1]), true);
    check_p3(&texels, 5e-4);
    assert_eq!(told.len(), 1, "{told:?}");
    assert!(told[0].contains("face.png: has the `cICP` 2, 2, 0, 1, which is not followed"), "{told:?}");
}

#[test]
fn gamma_and_primaries_stand_in_for_a_profile() {
    let (texels, _) = read_png(&Said::default().words(*b"gAMA", &[100_000]), true);
    let linear = CODES.map(|rgb| rgb.map(|code| (f64::from(code) / 65535.0) as f32));
    assert_eq!(texels, linear);
    let p3 = [31270, 32900, 68000, 32000, 26500, 69000, 15000, 6000];
    check_p3(&read_png(&Said::default().words(*b"cHRM", &p3), true).0, 2e-5);
    let both = read_png(&Said::default().words(*b"gAMA", &[45455]).words(*b"cHRM", &p3), true).0;
    assert!((f64::from(both[5][0]) - (32768.0_f64 / 65535.0).powf(1.0 / 0.45455)).abs() < 1e-6);
}

#[test]
fn grey_is_read_by_a_profile_of_grey() {
    let said = Said::profile(&ColorProfile::new_gray_with_gamma(1.8));
    let (texels, told) = colours(&png_of(&said, png::ColorType::Grayscale, true)).unwrap();
    assert_eq!(told, [""; 0]);
    // 1.8 in 256ths.
    let want = (51400.0_f64 / 65535.0).powf(461.0 / 256.0) as f32;
    assert!(texels[7].iter().all(|value| (value - want).abs() < 1e-6), "{:?}, not {want}", texels[7]);
    let (_, told) = read_png(&said, true);
    assert!(told[0].contains("is of grey, and the image has colours"), "{told:?}");
}

/// The profile with a word of it replaced wherever it stands.
fn with_word(profile: &ColorProfile, from: [u8; 4], to: [u8; 4]) -> Said {
    let mut bytes = profile.encode().unwrap();
    let places: Vec<usize> = (0..bytes.len() - 3).filter(|&i| bytes[i..i + 4] == from).collect();
    assert!(!places.is_empty());
    places.into_iter().for_each(|i| bytes[i..i + 4].copy_from_slice(&to));
    Said { profile: Some(bytes), ..Said::default() }
}

#[test]
fn profiles_that_are_not_followed_are_told_and_leave_srgb() {
    let p3 = ColorProfile::new_display_p3();
    let plain = read_png(&Said::default(), false).0;
    for (said, words) in [
        (
            with_word(&p3, *b"RGB ", *b"CMYK"),
            "has a colour profile that is of Cmyk, neither of RGB nor of grey",
        ),
        (with_word(&p3, *b"rTRC", *b"zTRC"), "has a colour profile of tables"),
        (with_word(&p3, *b"rXYZ", *b"zXYZ"), "has a colour profile with primaries that lie on a line"),
        (with_word(&p3, *b"acsp", *b"none"), "has a colour profile that is damaged"),
        (Said { profile: Some(vec![7; 40]), ..Said::default() }, "has a colour profile that is damaged"),
        (Said::default().chunk(*b"iCCP", b"name\0\0no deflate"), "its colour profile (iCCP) is damaged"),
        (Said::default().chunk(*b"cICP", &[12, 13, 0, 0]), "has the `cICP` 12, 13, 0, 0"),
        (Said::default().words(*b"cHRM", &[0; 8]), "has a colour profile with primaries that lie on a line"),
    ] {
        let (texels, told) = read_png(&said, false);
        assert_eq!(told.len(), 1, "{words}: {told:?}");
        assert!(told[0].contains("face.png: ") && told[0].contains(words), "{words}: {told:?}");
        assert_eq!(texels, plain, "{words}");
    }
    assert!(matches!(Space::of_gamma(Some(0.0), None), Err(space::Unheeded::Told(_))));
}

#[test]
fn light_without_a_white_is_refused() {
    for said in [
        Said::default().chunk(*b"cICP", &[9, 16, 0, 1]),
        Said::default().chunk(*b"cICP", &[9, 18, 0, 1]),
        Said::profile(&ColorProfile::new_display_p3_pq()),
    ] {
        let told = colours(&png_of(&said, png::ColorType::Rgb, true)).unwrap_err().to_string();
        assert!(told.contains("face.png: holds colours in "), "{told}");
        assert!(told.contains("a white that it does not tell. Save the picture as linear OpenEXR"), "{told}");
    }
}

#[test]
fn numbers_that_are_no_colours_are_taken_as_they_are() {
    let [plain, p3] = [Said::default(), Said::profile(&ColorProfile::new_display_p3())].map(|said| {
        let (folder, path) = file("normal.png", &png_of(&said, png::ColorType::Rgb, true));
        let picture = picture(&path, true).unwrap();
        let of_bytes = picture_of(&path, &std::fs::read(&path).unwrap(), true).unwrap();
        assert_eq!(picture.texels, of_bytes.texels);
        let read = (normal_map(&path, false).unwrap().0.texels, scalar_map(&path).unwrap().texels);
        drop(folder);
        (read, picture.texels)
    });
    assert_eq!(plain, p3);
}

#[test]
fn a_target_of_p3_does_not_count_where_a_code_is_clipped() {
    let three = [0_u16, 128, 255];
    let codes: Vec<[u16; 3]> = (0..27).map(|i| [three[i % 3], three[i / 3 % 3], three[i / 9]]).collect();
    let profile = ColorProfile::new_display_p3().encode().unwrap();
    let bytes: Vec<u8> = codes.as_flattened().iter().map(|&code| code as u8).collect();
    let mut png = Vec::new();
    let mut encoder = image::codecs::png::PngEncoder::new(&mut png);
    image::ImageEncoder::set_icc_profile(&mut encoder, profile).unwrap();
    image::ImageEncoder::write_image(encoder, &bytes, 27, 1, image::ExtendedColorType::Rgb8).unwrap();
    let (_folder, path) = file("front.png", &png);
    let target = target(&path, Seen::default(), (27, 1), &mut Vec::new()).unwrap();
    // A mixture tells of no channel whether it was clipped.
    assert!(target.clipped_at.is_none());
    let counts = target.mask.unwrap();
    for (counts, codes) in counts.iter().zip(&codes) {
        let clipped = codes.iter().any(|code| [0, 255].contains(code));
        assert_eq!(*counts, f32::from(u8::from(!clipped)), "{codes:?}");
    }
    // The grey in the middle alone.
    assert!(counts[13] == 1.0 && counts.iter().sum::<f32>() == 1.0);
}

#[test]
fn jpeg_files_have_profiles_too() {
    let jpeg = |profile: Option<&ColorProfile>| {
        let mut bytes = Vec::new();
        let mut encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 100);
        if let Some(profile) = profile {
            image::ImageEncoder::set_icc_profile(&mut encoder, profile.encode().unwrap()).unwrap();
        }
        encoder.encode(&[200; 8 * 8 * 3], 8, 8, image::ExtendedColorType::Rgb8).unwrap();
        bytes
    };
    let plain = colours(&jpeg(None)).unwrap();
    assert_eq!(colours(&jpeg(Some(&ColorProfile::new_srgb()))).unwrap(), plain);
    let adobe = colours(&jpeg(Some(&ColorProfile::new_adobe_rgb()))).unwrap().0;
    let code = plain.0[0][0];
    assert!((code - srgb_decode(200.0 / 255.0) as f32).abs() < 0.02, "{code}");
    assert!((f64::from(adobe[0][0]) - (200.0_f64 / 255.0).powf(563.0 / 256.0)).abs() < 0.02);
    assert_ne!(adobe[0][0], code);
    // A marker without a profile behind it.
    let mut lost = jpeg(None);
    lost.splice(2..2, [&[0xff, 0xe2, 0, 14][..], b"ICC_PROFILE\0"].concat());
    let (texels, told) = colours(&lost).unwrap();
    assert_eq!(texels, plain.0);
    assert!(told[0].contains("its colour profile (APP2) is damaged"), "{told:?}");
}

#[test]
fn damaged_profiles_are_told_or_followed_and_never_panic() {
    let whole = ColorProfile::new_display_p3().encode().unwrap();
    let mut told = 0;
    let mut try_profile = |profile: &[u8]| {
        let said = Said { profile: Some(profile.to_vec()), ..Said::default() };
        // Claims alone: what is read is finite, or a refusal.
        match colours(&png_of(&said, png::ColorType::Rgb, false)) {
            Ok((texels, warnings)) => {
                told += warnings.len();
                assert!(texels.as_flattened().iter().all(|value| value.is_finite()));
            }
            Err(error) => assert!(error.to_string().contains("face.png"), "{error}"),
        }
    };
    (0..whole.len()).step_by(3).for_each(|length| try_profile(&whole[..length]));
    for (i, change) in (0..whole.len()).flat_map(|i| [0x80_u8, 0xff].map(|change| (i, change))) {
        let mut harmed = whole.clone();
        harmed[i] ^= change;
        try_profile(&harmed);
    }
    // All that end before the tags do, if no more.
    assert!(told > whole.len() / 6, "{told}");
}
