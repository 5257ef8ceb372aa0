//! `skinfit panorama`: the light of a place, photographed, as an environment.
//!
//! - `merge`: bracketed exposures of one view to radiance
//! - `stitch`: shots of several directions, or of a mirror ball, to a lat-long panorama
//! - `pictures`: files in and out

mod merge;
mod pictures;
mod stitch;

use super::{Exit, Refusal};

/// Make an environment of photographs: merge exposures, stitch shots
#[derive(clap::Args)]
#[command(
    after_help = "First each view's exposures are merged to a picture of radiance, then the pictures of a fisheye lens or a mirror ball are stitched to the panorama that [environment] names.\n\nExamples:\n  skinfit panorama merge --help\n  skinfit panorama stitch --help"
)]
pub(super) struct Arguments {
    #[command(subcommand)]
    what: What,
}

#[derive(clap::Subcommand)]
enum What {
    Merge(merge::Arguments),
    Stitch(stitch::Arguments),
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, Refusal> {
    match &arguments.what {
        What::Merge(arguments) => merge::run(arguments),
        What::Stitch(arguments) => stitch::run(arguments),
    }
}
