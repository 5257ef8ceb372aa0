//! Files of cubes, read back by small readers that know nothing of the writers.

use super::*;
use crate::model::cube::texel_direction;

/// A cube whose every texel differs: its direction, and a fourth number that tells the cube.
fn cube(size: usize, alpha: f32) -> Cube<f32> {
    Cube::from_fn(size, |face, column, row| {
        let [x, y, z] = texel_direction(face, column, row, size).map(|x| x as f32);
        [x, y, z, alpha]
    })
}

/// Where a file's texels begin, its side, and how many cubes.
struct Found {
    texels_at: usize,
    size: usize,
    cubes: usize,
}

fn word(file: &[u8], at: usize) -> usize {
    u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize
}

fn long(file: &[u8], at: usize) -> usize {
    u64::from_le_bytes(file[at..at + 8].try_into().unwrap()) as usize
}

/// As the specification's figure of the file's structure has it.
fn read_ktx2(file: &[u8]) -> Found {
    assert_eq!(&file[..12], &[0xAB, 0x4B, 0x54, 0x58, 0x20, 0x32, 0x30, 0xBB, 0x0D, 0x0A, 0x1A, 0x0A]);
    let header: Vec<usize> = (0..9).map(|i| word(file, 12 + 4 * i)).collect();
    let [97, 2, size, height, 0, layers, 6, 1, 0] = header[..] else { panic!("{header:?}") };
    assert_eq!(size, height);
    let [described_at, described, words_at, words] = [48, 52, 56, 60].map(|at| word(file, at));
    assert_eq!((described_at, words_at), (104, 104 + described));
    assert_eq!([64, 72].map(|at| long(file, at)), [0, 0]);
    let [texels_at, length, unpacked] = [80, 88, 96].map(|at| long(file, at));
    assert_eq!((texels_at + length, length), (file.len(), unpacked));
    assert!(texels_at % 8 == 0 && texels_at >= words_at + words && texels_at < words_at + words + 8);
    assert_eq!(word(file, described_at), described);
    Found { texels_at, size, cubes: layers.max(1) }
}

fn read_dds(file: &[u8]) -> Found {
    assert_eq!(&file[..4], b"DDS ");
    assert_eq!((word(file, 4), word(file, 76), &file[84..88]), (124, 32, &b"DX10"[..]));
    // A cube with all of its faces.
    assert_eq!(word(file, 112) & 0xFE00, 0xFE00);
    let [format, dimension, misc, cubes] = [128, 132, 136, 140].map(|at| word(file, at));
    assert_eq!((format, dimension, misc), (10, 3, 4));
    let size = word(file, 16);
    assert_eq!((size, size * 8), (word(file, 12), word(file, 20)));
    Found { texels_at: 148, size, cubes }
}

/// The texel along a direction as Direct3D and Vulkan select it: their table of major axes, written out.
fn look_up(file: &[u8], found: &Found, cube: usize, [x, y, z]: [f32; 3]) -> [f32; 4] {
    let (ax, ay, az) = (x.abs(), y.abs(), z.abs());
    let (face, sc, tc, ma) = if ax >= ay && ax >= az {
        if x > 0.0 { (0, -z, -y, ax) } else { (1, z, -y, ax) }
    } else if ay >= az {
        if y > 0.0 { (2, x, z, ay) } else { (3, x, -z, ay) }
    } else if z > 0.0 {
        (4, x, -y, az)
    } else {
        (5, -x, -y, az)
    };
    let texel = |c: f32| (((c / ma + 1.0) / 2.0 * found.size as f32) as usize).min(found.size - 1);
    let (column, row) = (texel(sc), texel(tc));
    let at = found.texels_at + 8 * (((cube * 6 + face) * found.size + row) * found.size + column);
    [0, 2, 4, 6].map(|k| half(u16::from_le_bytes(file[at + k..at + k + 2].try_into().unwrap())))
}

/// IEEE 754 binary16, by its definition; no infinities are expected.
fn half(bits: u16) -> f32 {
    let (sign, exponent, fraction) = (bits >> 15, i32::from(bits >> 10 & 31), f32::from(bits & 1023));
    assert_ne!(exponent, 31, "not a finite number");
    let size = match exponent {
        0 => fraction * 2_f32.powi(-24),
        _ => (1.0 + fraction / 1024.0) * 2_f32.powi(exponent - 15),
    };
    if sign == 1 { -size } else { size }
}

fn written(format: CubeFormat, cubes: &[&Cube<f32>], notes: &[(&str, String)]) -> (Vec<u8>, usize) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cube");
    let clamped = write_cubes(&path, format, cubes, notes).unwrap();
    (std::fs::read(path).unwrap(), clamped)
}

fn read(format: CubeFormat, file: &[u8]) -> Found {
    match format {
        CubeFormat::Ktx2 => read_ktx2(file),
        CubeFormat::Dds => read_dds(file),
    }
}

#[test]
fn a_direction_finds_the_texel_that_the_projects_own_lookup_finds() {
    let cubes = [cube(5, 0.25), cube(5, 0.75)];
    for format in CubeFormat::ALL {
        let (file, clamped) = written(format, &[&cubes[0], &cubes[1]], &[]);
        let found = read(format, &file);
        assert_eq!((found.size, found.cubes, clamped), (5, 2, 0), "{format:?}");
        assert_eq!(file.len(), found.texels_at + 2 * 6 * 25 * 8);
        for (k, cube) in cubes.iter().enumerate() {
            for texel in 0..150 {
                let d = texel_direction(texel / 25, texel % 5, texel / 5 % 5, 5);
                let own: [f64; 4] = cube.map(|texel| texel.map(f64::from)).sample(d);
                let got = look_up(&file, &found, k, d.map(|x| x as f32));
                for c in 0..4 {
                    // Halves between 0.5 and 1 are 2^-11 apart; the lookup at a texel's centre is that texel.
                    let error = (f64::from(got[c]) - own[c]).abs();
                    assert!(error < 0.6 * 2_f64.powi(-11), "{format:?}, cube {k}: {d:?}: {got:?} {own:?}");
                }
            }
        }
    }
}

#[test]
fn one_cube_is_no_array_and_a_ktx2_file_tells_what_it_holds() {
    let cube = cube(3, 1.0);
    let (file, _) = written(CubeFormat::Ktx2, &[&cube], &[("skinfitExponents", "8 32".to_owned())]);
    assert_eq!(word(&file, 32), 0, "a layer count makes an array of it");
    let (at, length) = (word(&file, 56), word(&file, 60));
    let (mut rest, mut pairs) = (&file[at..at + length], Vec::new());
    while !rest.is_empty() {
        let length = word(rest, 0);
        let text = std::str::from_utf8(&rest[4..4 + length]).unwrap();
        pairs.push(text.split_terminator('\0').map(str::to_owned).collect::<Vec<_>>());
        rest = &rest[4 + length.next_multiple_of(4)..];
    }
    let writer = concat!("skinfit ", env!("CARGO_PKG_VERSION"));
    // By their names, as the specification asks.
    let wanted = [["KTXorientation", "rd"], ["KTXwriter", writer], ["skinfitExponents", "8 32"]];
    assert_eq!(pairs, wanted);
}

#[test]
fn a_ktx2_file_describes_four_signed_halves() {
    let (file, _) = written(CubeFormat::Ktx2, &[&cube(1, 1.0)], &[]);
    let at = word(&file, 48);
    // The block's length with its version; RGBSDA, BT.709, linear; a single texel of 8 bytes.
    assert_eq!([4, 8, 12, 16, 20, 24].map(|i| word(&file, at + i)), [0, 88 << 16 | 2, 0x01_01_01, 0, 8, 0]);
    let sample = |i: usize| (0..4).map(|k| word(&file, at + 28 + 16 * i + 4 * k)).collect::<Vec<_>>();
    for (i, channel) in [0xC0, 0xC1, 0xC2, 0xCF].into_iter().enumerate() {
        assert_eq!(sample(i), [channel << 24 | 15 << 16 | (16 * i), 0, 0xBF80_0000, 0x3F80_0000]);
    }
}

#[test]
fn what_halves_cannot_hold_is_as_large_as_they_get_and_is_counted() {
    let bright = Cube::from_fn(2, |face, column, row| match (face, column, row) {
        (4, 1, 0) => [1e6, -7e4, 65504.0, 1e-5],
        _ => [0.0; 4],
    });
    for format in CubeFormat::ALL {
        let (file, clamped) = written(format, &[&bright], &[]);
        assert_eq!(clamped, 2, "{format:?}");
        let [r, g, b, a] = look_up(&file, &read(format, &file), 0, [0.5, 0.5, 1.0]);
        assert_eq!([r, g, b], [65504.0, -65504.0, 65504.0]);
        // Small halves are 2^-24 apart.
        assert!((a - 1e-5).abs() <= 2_f32.powi(-25), "{a}");
    }
}

#[test]
fn what_cannot_be_written_is_refused_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |cubes: &[&Cube<f32>]| {
        let path = folder.path().join("a.dds");
        write_cubes(&path, CubeFormat::Dds, cubes, &[]).unwrap_err().to_string()
    };
    assert!(refused(&[]).contains("a.dds: 0 cubes"));
    assert!(refused(&[&cube(2, 0.0), &cube(4, 0.0)]).contains("cubes of 2 and 4 texels"));
    let broken = Cube::from_fn(2, |face, _, _| [if face == 3 { f32::NAN } else { 0.0 }; 4]);
    assert!(refused(&[&cube(2, 0.0), &broken]).contains("cube 1, face 3"));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
