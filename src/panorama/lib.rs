//! Photographed light: from a camera's pictures to a lat-long panorama.
//!
//! Arrays in, arrays out; files are the caller's. In the order of use:
//!
//! - [`response`]: the camera's response, given or recovered from bracketed pictures
//! - [`merge`]: exposures of one view to one picture of radiance, with what is doubtful about them
//! - [`lens`]: fisheyes and mirror balls, from points of an image to directions and back
//! - [`stitch`]: shots of several directions to one lat-long panorama
//! - [`grey_card`]: exposure and white balance from a patch of known reflectance
//!
//! and what they share: [`picture`], the array of radiance; [`latlong`], the panorama's directions; `robust`, medians.
//!
//! Radiance is linear, with Rec.709 primaries where the camera's pictures have them: nothing here turns one set of
//! primaries into another. Points of an image are in pixels from its top left corner, x to the right and y down, so
//! that the first pixel's centre is (0.5, 0.5). A camera looks along -Z, with +Y up and +X to the right.
//!
//! All of it runs on all cores, and gives the same bits on any number of them.

pub mod grey_card;
pub mod latlong;
pub mod lens;
pub mod merge;
pub mod picture;
pub mod response;
mod robust;
pub mod stitch;
