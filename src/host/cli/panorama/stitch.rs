//! `skinfit panorama stitch`: shots of several directions to a lat-long panorama.

use std::path::{Path, PathBuf};

use glam::{DMat3, DQuat, DVec2, DVec3};
use skinfit_panorama::lens::{Fisheye, Lens, MirrorBall, Projection};
use skinfit_panorama::stitch::{Shot, StitchError, StitchOptions, stitch};

use super::pictures;
use crate::cli::columns::aligned;
use crate::cli::{Exit, Refusal, say, tell};
use crate::scene::digits;

/// Stitch pictures of radiance, taken by a fisheye lens or of a mirror ball, to a lat-long panorama
#[derive(clap::Args)]
#[command(
    after_help = "SHOTS is a TOML file, a table a picture:\n\n  [[shot]]\n  file = \"north.exr\"              # radiance: what `merge` writes\n  lens = \"equidistant\"            # or \"equisolid\", \"mirror_ball\"\n  centre = [1024.0, 1021.5]       # of the image circle, or the ball, in pixels from the upper left corner\n  radius = 980.0                  # pixels\n  field_of_view_degrees = 190.0   # of the whole circle; not of a ball\n  towards = [0, 0, -1]            # where the camera looks; -Z is the panorama's middle\n  up = [0, 1, 0]                  # what is upright in the picture\n  gain = 1.0                      # optional\n\nOrientations need to be right to some five degrees: they are refined where shots overlap, and so are exposures; the first shot stands as it is. Of a ball, camera_degrees (10) and trusted (0.97) say how much of its middle and of its rim is left out.\n\nExamples:\n  skinfit panorama stitch shots.toml -o sky.exr\n  skinfit panorama stitch shots.toml -o sky.exr --width 4096 --feather 10"
)]
pub(super) struct Arguments {
    /// The shots.
    shots: PathBuf,
    /// The panorama's width in texels; its height is half of that.
    #[arg(long, value_name = "TEXELS", default_value_t = 2048)]
    width: usize,
    /// Degrees over which a shot fades in at its border.
    #[arg(long, value_name = "DEGREES", default_value_t = 20.0)]
    feather: f64,
    /// Leave orientations as they are told.
    #[arg(long)]
    no_refine: bool,
    /// Leave exposures as they are told.
    #[arg(long)]
    no_gains: bool,
    /// Leave black what no shot sees, instead of filling it from around.
    #[arg(long)]
    no_fill: bool,
    /// The panorama to write.
    #[arg(short, long, value_name = "FILE.exr")]
    output: PathBuf,
}

#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct ShotsFile {
    shot: Vec<ShotTable>,
}

#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct ShotTable {
    file: PathBuf,
    lens: LensName,
    centre: [f64; 2],
    radius: f64,
    field_of_view_degrees: Option<f64>,
    towards: [f64; 3],
    #[serde(default = "upright")]
    up: [f64; 3],
    #[serde(default = "one")]
    gain: f64,
    camera_degrees: Option<f64>,
    trusted: Option<f64>,
}

#[derive(Clone, Copy, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
enum LensName {
    Equidistant,
    Equisolid,
    MirrorBall,
}

const fn upright() -> [f64; 3] {
    [0.0, 1.0, 0.0]
}

const fn one() -> f64 {
    1.0
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, Refusal> {
    pictures::check_output(&arguments.output)?;
    let (names, shots) = read(&arguments.shots)?;
    let options = StitchOptions {
        width: arguments.width,
        feather_degrees: arguments.feather,
        refine: !arguments.no_refine,
        gains: !arguments.no_gains,
        fill: !arguments.no_fill,
    };
    let stitched = stitch(&shots, &options).map_err(|error| refused(&arguments.shots, &error))?;
    stitched.doubts.iter().for_each(|doubt| tell(&format!("warning: {doubt}")));
    let head = ["shot", "turned by, degrees", "times", "alike"].map(str::to_owned);
    let rows = names.iter().enumerate().map(|(i, name)| {
        let alike = stitched.correlations[i].map_or_else(|| "-".to_owned(), |share| digits(share, 3));
        [name.clone(), digits(stitched.turned_degrees[i], 3), digits(stitched.gains[i], 4), alike]
    });
    say(aligned(&std::iter::once(head).chain(rows).collect::<Vec<_>>()).trim_end())?;
    if stitched.unseen > 0.0 {
        let (share, done) =
            (digits(100.0 * stitched.unseen, 3), if options.fill { "filled from around" } else { "black" });
        say(&format!("{share}% of the sphere is in no shot: {done}"))?;
    }
    pictures::write(&arguments.output, &stitched.panorama)?;
    say(&format!("wrote {}", arguments.output.display()))?;
    Ok(Exit::Done)
}

/// What a stitch refuses is the file's, but for what the command line says.
fn refused(path: &Path, error: &StitchError) -> Refusal {
    match error {
        StitchError::Width(_) | StitchError::Feather(_) => Refusal::new(error.to_string()),
        _ => Refusal::new(format!("{}: {error}", path.display())),
    }
}

/// The shots of a file, and what each picture is called.
fn read(path: &Path) -> Result<(Vec<String>, Vec<Shot>), Refusal> {
    let refuse = |what: String| Refusal::new(format!("{}: {what}", path.display()));
    let text = std::fs::read_to_string(path).map_err(|error| {
        refuse(format!("cannot be read: {error}. Name a file of shots (--help shows one)."))
    })?;
    let file: ShotsFile = toml::from_str(&text).map_err(|error| {
        let line =
            error.span().map_or(1, |span| 1 + text[..span.start.min(text.len())].matches('\n').count());
        let what = error.message().replace(char::is_control, " ");
        refuse(format!("line {line}: {}. --help shows such a file.", what.trim_end_matches('.')))
    })?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut shots = Vec::new();
    for (i, table) in file.shot.iter().enumerate() {
        let of_shot = |what: String| refuse(format!("shot {i}: {what}"));
        let orientation = looking(table.towards, table.up).ok_or_else(|| {
            of_shot("towards and up are no two directions. Give up across towards.".to_owned())
        })?;
        let lens = lens(table).map_err(of_shot)?;
        let picture =
            pictures::radiance(&folder.join(&table.file)).map_err(|refusal| of_shot(refusal.words))?;
        shots.push(Shot { picture, lens, orientation, gain: table.gain });
    }
    let names = file.shot.iter().map(|table| table.file.display().to_string()).collect();
    Ok((names, shots))
}

/// Refuse what another lens has, as its number would say nothing here.
fn check_foreign(table: &ShotTable) -> Result<(), String> {
    let ball = table.lens == LensName::MirrorBall;
    let (kind, other) = if ball { ("a mirror ball", "a fisheye") } else { ("a fisheye", "a mirror ball") };
    let foreign: &[(&str, bool)] = if ball {
        &[("field_of_view_degrees", table.field_of_view_degrees.is_some())]
    } else {
        &[("camera_degrees", table.camera_degrees.is_some()), ("trusted", table.trusted.is_some())]
    };
    match foreign.iter().find(|(_, given)| *given) {
        Some((key, _)) => {
            Err(format!("{key} is {other}'s, and its lens is {kind}. Leave it out, or correct lens."))
        }
        None => Ok(()),
    }
}

fn lens(table: &ShotTable) -> Result<Lens, String> {
    check_foreign(table)?;
    let (centre, radius) = (DVec2::from(table.centre), table.radius);
    let projection = match table.lens {
        LensName::Equidistant => Projection::Equidistant,
        LensName::Equisolid => Projection::Equisolid,
        LensName::MirrorBall => {
            let (camera_degrees, trusted) =
                (table.camera_degrees.unwrap_or(10.0), table.trusted.unwrap_or(0.97));
            return Ok(Lens::MirrorBall(MirrorBall { centre, radius, camera_degrees, trusted }));
        }
    };
    let field_of_view_degrees =
        table.field_of_view_degrees.ok_or("has no field_of_view_degrees. Give that of its circle.")?;
    Ok(Lens::Fisheye(Fisheye { projection, centre, radius, field_of_view_degrees }))
}

/// From a camera that looks along its -Z to the world.
fn looking(towards: [f64; 3], up: [f64; 3]) -> Option<DQuat> {
    let back = -DVec3::from(towards).try_normalize()?;
    let right = DVec3::from(up).try_normalize()?.cross(back);
    // Nearer to the axis what is upright is what roundings make of it.
    let right = (right.length() > 1e-6).then(|| right.normalize())?;
    Some(DQuat::from_mat3(&DMat3::from_cols(right, back.cross(right), back)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHOTS: &str = "[[shot]]
file = \"shot.png\"
lens = \"equidistant\"
centre = [2.0, 2.0]
radius = 1.5
field_of_view_degrees = 180.0
towards = [0, 0, -1]
up = [0, 1, 0]
gain = 1.0

[[shot]]
file = \"shot.png\"
lens = \"mirror_ball\"
centre = [2.0, 2.0]
radius = 1.5
towards = [0, 0, 1]
camera_degrees = 10.0
trusted = 0.97
";

    /// Whatever stands in the file: shots, or one paragraph that names it.
    #[test]
    fn no_file_of_shots_makes_its_reader_panic() {
        let folder = tempfile::tempdir().unwrap();
        image::RgbImage::new(4, 4).save(folder.path().join("shot.png")).unwrap();
        let path = folder.path().join("shots.toml");
        let read_bytes = |bytes: &[u8]| {
            std::fs::write(&path, bytes).unwrap();
            let read = read(&path);
            if let Err(refusal) = &read {
                assert!(refusal.words.starts_with(&folder.path().display().to_string()));
                assert!(!refusal.words.contains('\n'), "{}", refusal.words);
            }
            read.is_ok()
        };
        assert!(read_bytes(SHOTS.as_bytes()));
        for at in 0..SHOTS.len() {
            read_bytes(&SHOTS.as_bytes()[..at]);
            for odd in *b"\0-9\"[\xff" {
                let mut bytes = SHOTS.as_bytes().to_vec();
                bytes[at] = odd;
                read_bytes(&bytes);
            }
        }
        for (from, to) in
            [("1.5", "nan"), ("2.0", "inf"), ("-1", "-1e308"), ("1.0", "\"x\""), ("[0, 1, 0]", "[]")]
        {
            read_bytes(SHOTS.replace(from, to).as_bytes());
        }
    }
}
