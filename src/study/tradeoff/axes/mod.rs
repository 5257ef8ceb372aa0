//! The axes, in the order of documentation.

mod cubes;
mod diffusion;
mod filter;
mod fits;
mod format;
mod lobes;
mod pixels;
mod quality;
mod rays;
mod remeshed;
mod samples;
mod shadows;
mod silhouette;
mod sky_lights;
mod solver;
mod textures;
mod ways;

use super::axis::Axis;

/// Every axis.
#[must_use]
pub fn all() -> Vec<&'static dyn Axis> {
    vec![
        &format::Formats,
        &silhouette::Silhouettes,
        &cubes::IRRADIANCE,
        &cubes::SPECULAR,
        &cubes::HILITE,
        &filter::Filters,
        &lobes::Density,
        &rays::Rays,
        &sky_lights::SkyLights,
        &ways::SKY,
        &ways::LOBE,
        &ways::MODEL,
        &ways::SPLIT_SUM,
        &ways::LOOKUP,
        &ways::NORMALS,
        &ways::REFLECTION,
        &ways::BOUNCES,
        &ways::THROUGH,
        &diffusion::TAPS,
        &diffusion::LIGHT_MAP_SIZE,
        &diffusion::SEAMS,
        &diffusion::AMBIENT_NORMAL,
        &diffusion::STRETCH,
        &diffusion::UNBLURRED,
        &diffusion::COMBINED,
        &diffusion::LEVELS,
        &samples::Samples,
        &textures::Textures,
        &shadows::Shadows,
        &pixels::Pixels,
        &solver::Solvers,
    ]
}
