//! `skinfit panorama merge`: bracketed exposures of one view to radiance.

use std::path::{Path, PathBuf};

use skinfit_panorama::grey_card::{self, Normalise, REFLECTANCE, Rectangle};
use skinfit_panorama::merge::{
    Exposure, ExposureError, MergeOptions, Merged, Weighting, check_exposures, merge,
};
use skinfit_panorama::response::{Response, SMOOTHNESS, recover};

use super::pictures;
use crate::cli::columns::aligned;
use crate::cli::{Exit, Refusal, say, tell};
use crate::output;
use crate::scene::digits;

/// An uneven card is no card.
const UNEVEN: f64 = 0.1;

/// Merge photographs of one view, taken with different shutter times, to a picture of radiance
#[derive(clap::Args)]
#[command(
    after_help = "Each pixel is the mean of the exposures that see it, by what is known of their noise: clipped ones are left out, and what shares a pixel with them, unless the photographs show that it is not spoilt. Told afterwards: pixels that no exposure sees, shots that are shifted against each other, and shutter times that the pictures contradict.\n\nThe response is how the camera turns light into codes. srgb is what JPEG files claim; recover finds it from the photographs themselves (Debevec and Malik 1997); gamma=G is a power, 1 for linear codes.\n\nExamples:\n  skinfit panorama merge a.png b.png c.png --seconds 1/1000,1/60,1/4 -o north.exr\n  skinfit panorama merge *.jpg --seconds 1/1000,1/250,1/60 --response recover --align -o ball.exr\n  skinfit panorama merge *.jpg --seconds 1/1000,1/250,1/60 --response recover --write-response camera.csv -o ball.exr\n  skinfit panorama merge a.png b.png --seconds 0.01,0.1 --grey-card 800,600,40,40 -o north.exr"
)]
pub(super) struct Arguments {
    /// The photographs: PNG or JPEG, of 8 or 16 bits.
    #[arg(required = true)]
    photographs: Vec<PathBuf>,
    /// How long the shutter was open for each, in their order: 0.004 or 1/250. What aperture and sensitivity differ by goes
    /// with it: 1/100 at ISO 400 is 4/100 at ISO 100.
    #[arg(long, value_name = "LIST", value_delimiter = ',', required = true, value_parser = seconds)]
    seconds: Vec<f64>,
    /// The camera's response: srgb, recover, or gamma=G.
    #[arg(long, default_value = "srgb", value_parser = parse_response)]
    response: Asked,
    /// With `recover`: write what was found here, a row a code, as a view's `response` takes it.
    #[arg(long, value_name = "FILE.csv")]
    write_response: Option<PathBuf>,
    /// How exposures are weighed: noise (by a sensor's), or hat (by distance from both ends of the codes).
    #[arg(long, default_value = "noise", value_parser = ["noise", "hat"])]
    weighting: String,
    /// Take back shifts between the photographs, by whole pixels.
    #[arg(long)]
    align: bool,
    /// Where a grey card is, in pixels: it is made grey.
    #[arg(long, value_name = "X,Y,WIDTH,HEIGHT", value_parser = rectangle)]
    grey_card: Option<Rectangle>,
    /// With a grey card: make it this bright as well, its reflectance under light of 1 (a usual one has 0.18).
    #[arg(long, value_name = "SHARE", num_args = 0..=1, default_missing_value = "0.18", requires = "grey_card")]
    reflectance: Option<f64>,
    /// The picture of radiance to write.
    #[arg(short, long, value_name = "FILE.exr")]
    output: PathBuf,
}

/// A response, or that it is to be found.
#[derive(Clone, Debug)]
enum Asked {
    Given(Response),
    Recovered,
}

/// `0.004` or `1/250`.
fn seconds(text: &str) -> Result<f64, String> {
    let number = |text: &str| text.trim().parse::<f64>().ok();
    let value = match text.split_once('/') {
        Some((above, below)) => number(above).zip(number(below)).map(|(above, below)| above / below),
        None => number(text),
    };
    let sound = value.filter(|seconds| seconds.is_finite() && *seconds > 0.0);
    sound.ok_or_else(|| format!("`{text}` is no time: give seconds, such as 0.004 or 1/250"))
}

/// `800,600,40,40`.
fn rectangle(text: &str) -> Result<Rectangle, String> {
    let numbers: Option<Vec<usize>> = text.split(',').map(|number| number.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[x, y, width, height]) => Ok(Rectangle { x, y, width, height }),
        _ => Err("give the left column, the top row, and how many of both: 800,600,40,40".to_owned()),
    }
}

fn parse_response(text: &str) -> Result<Asked, String> {
    let gamma = || text.strip_prefix("gamma=")?.parse::<f64>().ok().filter(|g| g.is_finite() && *g > 0.0);
    match text {
        "srgb" => Ok(Asked::Given(Response::Srgb)),
        "recover" => Ok(Asked::Recovered),
        _ => match gamma() {
            Some(gamma) => Ok(Asked::Given(Response::Gamma(gamma))),
            None => Err("give srgb, recover, or gamma=G with a number above 0".to_owned()),
        },
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, Refusal> {
    let (count, times) = (arguments.photographs.len(), arguments.seconds.len());
    if count != times {
        return Err(Refusal::new(format!(
            "--seconds: {times} for {count} photographs. Give one for each, in their order."
        )));
    }
    if let Some(path) = &arguments.write_response {
        if !matches!(arguments.response, Asked::Recovered) {
            return Err(Refusal::new(
                "--write-response: the response is given. Find it with --response recover, or leave the option out.",
            ));
        }
        if pictures::place(path) == pictures::place(&arguments.output) {
            let path = path.display();
            return Err(Refusal::new(format!(
                "--write-response: {path} is where the radiance goes. Name another file."
            )));
        }
    }
    pictures::check_output(&arguments.output)?;
    let each = arguments.photographs.iter().zip(&arguments.seconds);
    let exposures: Vec<Exposure> =
        each.map(|(path, &seconds)| pictures::exposure(path, seconds)).collect::<Result<_, _>>()?;
    check_exposures(&exposures).map_err(|error| refused(&arguments.photographs, &error))?;
    let primaries = pictures::primaries(&arguments.photographs)?;
    let response = match &arguments.response {
        Asked::Given(response) => response.clone(),
        Asked::Recovered => {
            let found = recover(&exposures, SMOOTHNESS)?;
            let off = found.residual.map(|share| format!("{}%", digits(100.0 * share, 2))).join(", ");
            say(&format!("response recovered; photographs lie off it by {off} (red, green, blue)"))?;
            found.response
        }
    };
    let weighting = if arguments.weighting == "hat" { Weighting::Hat } else { Weighting::default() };
    let mut merged = merge(&exposures, &response, MergeOptions { weighting, align: arguments.align })?;
    if let Some(to_rec709) = primaries {
        pictures::mix(&mut merged.picture, to_rec709);
    }
    let balanced = match arguments.grey_card {
        Some(rectangle) => Some(balance(&mut merged, rectangle, arguments.reflectance)?),
        None => None,
    };
    merged.doubts.iter().for_each(|doubt| tell(&format!("warning: {doubt}")));
    say(times_told(&arguments.photographs, &merged).trim_end())?;
    say(if merged.clipping_spoils {
        "a pixel is left out as a whole where one of its channels is clipped"
    } else {
        "beside a clipped channel the others count: in these photographs it does not spoil them"
    })?;
    tell_counts(&merged);
    if let Some(told) = balanced {
        say(&told)?;
    }
    // Nothing is written before all that may be refused is behind.
    if let (Some(path), Response::Table(table)) = (&arguments.write_response, &response) {
        let rows: String = table.iter().map(|[r, g, b]| format!("{r:?},{g:?},{b:?}\n")).collect();
        output::write(path, rows.as_bytes())?;
        say(&format!("wrote {}", path.display()))?;
    }
    pictures::write(&arguments.output, &merged.picture)?;
    say(&format!("wrote {}", arguments.output.display()))?;
    Ok(Exit::Done)
}

/// What is wrong with an exposure is its photograph's.
fn refused(photographs: &[PathBuf], error: &ExposureError) -> Refusal {
    match error.exposure().and_then(|exposure| photographs.get(exposure)) {
        Some(path) => Refusal::new(format!("{}: {error}", path.display())),
        None => Refusal::new(error.to_string()),
    }
}

/// Each photograph's shutter time, as told and by the pictures.
fn times_told(photographs: &[PathBuf], merged: &Merged) -> String {
    let head = ["photograph", "seconds", "by the pictures"].map(str::to_owned);
    let row = |(path, time): (&PathBuf, &skinfit_panorama::merge::times::ShutterTime)| {
        let name = path.file_name().map_or(path.as_path(), Path::new).display().to_string();
        [
            name,
            digits(time.told, 4),
            time.measured.map_or_else(|| "-".to_owned(), |seconds| digits(seconds, 4)),
        ]
    };
    let rows = photographs.iter().zip(&merged.times).map(row);
    aligned(&std::iter::once(head).chain(rows).collect::<Vec<_>>())
}

/// Pixels of which something is not known, as warnings.
fn tell_counts(merged: &Merged) {
    let counts = &merged.counts;
    for (count, what) in [
        (
            counts.clipped_everywhere,
            "clipped in every photograph: they are at least as bright as is written. Take a shorter one",
        ),
        (counts.dark_everywhere, "black in every photograph. Take a longer one"),
        (
            counts.between_exposures,
            "black in the shorter photographs and clipped in the longer ones. Take one between",
        ),
    ] {
        if count > 0 {
            tell(&format!("warning: {count} pixels are {what}."));
        }
    }
}

/// Make a card grey, and where a reflectance is given as bright as it says; returns what that was.
fn balance(merged: &mut Merged, rectangle: Rectangle, reflectance: Option<f64>) -> Result<String, Refusal> {
    let assumed = reflectance.unwrap_or(REFLECTANCE);
    let card = grey_card::measure(&merged.picture, Some(&merged.seen), rectangle, assumed)?;
    if card.unevenness > UNEVEN {
        let percent = digits(100.0 * card.unevenness, 2);
        tell(&format!(
            "warning: --grey-card: its pixels differ by {percent}%. Name a part of one evenly lit card."
        ));
    }
    let what = if reflectance.is_some() { Normalise::Exposure } else { Normalise::WhiteBalance };
    grey_card::normalise(&mut merged.picture, &card, what);
    let factors = if reflectance.is_some() { card.exposure } else { card.white_balance };
    Ok(format!("grey card: times {} (red, green, blue)", factors.map(|factor| digits(factor, 4)).join(", ")))
}
