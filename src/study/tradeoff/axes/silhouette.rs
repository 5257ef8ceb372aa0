//! How finely a mesh must be tessellated for silhouettes that are interpolated from its vertices.

use super::remeshed::Remeshed;
use crate::StudyError;
use crate::model::effects::Silhouette;
use crate::reference::Difference;
use crate::render::image::Image;
use crate::scene::facts::tessellation_error;
use crate::shader::{Budget, plan};
use crate::tradeoff::axis::{Choose, Rates, SceneAxis, Setting, Sweep, mark_pareto};
use crate::tradeoff::bench::Bench;
use crate::tradeoff::settings::Settings;

/// Where the silhouette is evaluated, against how fine the mesh is.
pub(super) struct Silhouettes;

/// How often the mesh is made coarser, each time with edges of twice the length.
const COARSER: usize = 3;
/// How often it is cut finer, each time with edges of half the length.
const FINER: usize = 2;

impl SceneAxis for Silhouettes {
    fn name(&self) -> &'static str {
        "silhouette"
    }

    fn applies(&self, bench: &Bench<'_>) -> Result<(), &'static str> {
        let scene = &bench.baked.scene;
        let asked = scene.effects.needs(Silhouette::Fragment).rim;
        asked.then_some(()).ok_or("no effect asks for the silhouette")
    }

    fn alike(&self, one: &Bench<'_>, other: &Bench<'_>) -> Result<(), &'static str> {
        let of = |bench: &Bench<'_>| (bench.baked.scene.mesh.pose(), bench.baked.scene.metres_per_unit);
        let ((one, unit), (other, other_unit)) = (of(one), of(other));
        let same = one.positions == other.positions && one.triangles == other.triangles && unit == other_unit;
        same.then_some(()).ok_or("it is swept over how fine a mesh is, and the scenes' meshes differ")
    }

    fn settable(&self) -> bool {
        true
    }

    fn seconds(&self, _: &Bench<'_>, rates: Rates) -> Result<f64, StudyError> {
        // On its own mesh three silhouettes beside the exact one, on each other mesh one.
        let images = 4 + 2 * (COARSER + FINER);
        Ok(images as f64 * (rates.trace + rates.images))
    }

    fn sweep(&self, bench: &Bench<'_>) -> Result<Sweep, StudyError> {
        let own = Remeshed::of(bench)?;
        let coarser = std::iter::successors(own.coarser(), Remeshed::coarser).take(COARSER);
        let mut settings = Vec::new();
        for mesh in coarser.collect::<Vec<_>>().iter().rev() {
            settings.extend(measure(bench, mesh, &[Silhouette::Vertex], false)?);
        }
        let all = [Silhouette::Vertex, Silhouette::Fragment, Silhouette::Bumped];
        settings.extend(measure(bench, &own, &all, true)?);
        for mesh in std::iter::successors(Some(own.finer()), |mesh| Some(mesh.finer())).take(FINER) {
            settings.extend(measure(bench, &mesh, &[Silhouette::Vertex], false)?);
        }
        mark_pareto(&mut settings);
        Ok(Sweep {
            axis: self.name(),
            title: "Silhouettes, and how fine the mesh is",
            method: "1 − |N·V| per vertex, per fragment (the reference) and from the bumped normal. The mesh is also made coarser (its \
                     shortest edges pulled together until a quarter of the triangles is left) and cut finer (each triangle into four of \
                     the same surface), several times, and each is compared with its own fragments. Cost is the planned operations a \
                     fragment; the edge is the median one, in millimetres where the scene has metres_per_unit. `sag` is how far \
                     1 − |N·V| is off by the angle between the normals of a triangle, 99th percentile. The bumped silhouette is another \
                     look, not an approximation: its error is how different it is."
                .to_owned(),
            cost: "operations",
            settings,
            traces: Vec::new(),
        })
    }
}

/// A mesh with some silhouettes, each beside the exact one on the same mesh.
fn measure(
    bench: &Bench<'_>,
    mesh: &Remeshed,
    silhouettes: &[Silhouette],
    own: bool,
) -> Result<Vec<Setting>, StudyError> {
    let exact = Settings { silhouette: Silhouette::Fragment, ..bench.settings() };
    let exact = mesh.evaluated(bench, exact)?.images(&bench.point())?;
    silhouettes.iter().map(|&silhouette| setting(bench, mesh, silhouette, &exact, own)).collect()
}

fn setting(
    bench: &Bench<'_>,
    mesh: &Remeshed,
    silhouette: Silhouette,
    exact: &[Image],
    own: bool,
) -> Result<Setting, StudyError> {
    let evaluated = mesh.evaluated(bench, Settings { silhouette, ..bench.settings() })?;
    let scene = &evaluated.scene;
    let edge = mesh.edge() * scene.metres_per_unit;
    let facts = scene.facts(&bench.point().params, Budget::Exact, false);
    let name = match silhouette {
        Silhouette::Vertex => format!("vertex, edges of {:.1} mm", 1e3 * edge),
        _ => silhouette.name().to_owned(),
    };
    Ok(Setting {
        name,
        choose: own.then_some(Choose::Silhouette(silhouette)),
        error: Difference::of_all(exact, &evaluated.images(&bench.point())?),
        cost: plan(&facts)?.cost,
        time: None,
        counts: vec![
            ("triangles", mesh.mesh.triangles.len() as f64),
            ("edge, mm", 1e3 * edge),
            ("sag", tessellation_error(scene)),
        ],
        reference: silhouette == Silhouette::Fragment,
        present: own && silhouette == bench.baked.scene.silhouette,
        pareto: false,
    })
}
