//! How finely a mesh must be tessellated for silhouettes that are interpolated from its vertices.

use crate::bake::VertexOcclusion;
use crate::model::effects::Silhouette;
use crate::prepare::PrepareError;
use crate::render::image::Image;
use crate::samples;
use crate::scene::mesh::{Mesh, PosedMesh};
use crate::shader::{Budget, Facts, facts::tessellation_error, plan};
use crate::study::StudyError;
use crate::study::reference::Difference;
use crate::study::tradeoff::axis::{Axis, Choose, Setting, Sweep, mark_front};
use crate::study::tradeoff::bench::{Bench, Evaluated, Settings};

/// Where the silhouette is evaluated, against how fine the mesh is.
pub(super) struct Silhouettes;

/// How often the mesh's triangles are cut into four.
const LEVELS: usize = 3;

impl Axis for Silhouettes {
    fn name(&self) -> &'static str {
        "silhouette"
    }

    fn applies(&self, bench: &Bench<'_>) -> Result<(), &'static str> {
        let scene = &bench.prepared.scene;
        let asked = scene.effects.needs(Silhouette::Fragment).rim;
        asked.then_some(()).ok_or("no effect asks for the silhouette")
    }

    fn sweep(&self, bench: &Bench<'_>) -> Result<Sweep, StudyError> {
        let mut settings = Vec::new();
        let mut finer = Finer::of(bench)?;
        for level in 0..LEVELS {
            if level > 0 {
                finer = finer.cut();
            }
            let exact = finer.images(bench, Silhouette::Fragment)?;
            let own = level == 0;
            settings.push(finer.setting(bench, Silhouette::Vertex, &exact, own)?);
            if own {
                settings.push(finer.setting(bench, Silhouette::Fragment, &exact, own)?);
                settings.push(finer.setting(bench, Silhouette::Bumped, &exact, own)?);
            }
        }
        mark_front(&mut settings);
        Ok(Sweep {
            axis: self.name(),
            title: "Silhouettes, and how fine the mesh is",
            method: "1 − |N·V| per vertex, per fragment (the reference) and from the bumped normal. The mesh is also cut finer, each \
                     triangle into four of the same surface, once and twice, and each is compared with its own fragments. Cost is the \
                     planned operations a fragment; the edge is the median one, in millimetres where the scene has metres_per_unit. `sag` \
                     is how far 1 − |N·V| is off by the angle between the normals of a triangle, 99th percentile. The bumped silhouette is \
                     another look, not an approximation: its error is how different it is."
                .to_owned(),
            cost: "operations",
            settings,
            traces: Vec::new(),
        })
    }
}

/// A mesh in the world, cut finer, with the occlusion of its vertices.
struct Finer {
    mesh: PosedMesh,
    open: Option<Vec<f32>>,
}

impl Finer {
    fn of(bench: &Bench<'_>) -> Result<Self, StudyError> {
        let scene = &bench.prepared.scene;
        let mesh = scene.mesh.pose();
        let occlusion = bench.prepared.occlusion.as_ref();
        let open = samples::posed_occlusion(scene, &scene.mesh.morphs, mesh.positions.len(), occlusion);
        Ok(Self { mesh, open: open.map_err(PrepareError::from)? })
    }

    /// Each triangle cut into four at the middles of its edges; the surface and its occlusion stay.
    fn cut(&self) -> Self {
        let mut middles = std::collections::HashMap::new();
        let (mut mesh, mut open) = (self.mesh.clone(), self.open.clone());
        let mut triangles = Vec::with_capacity(4 * mesh.triangles.len());
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                let (i, j) = (a as usize, b as usize);
                mesh.positions.push(0.5 * (mesh.positions[i] + mesh.positions[j]));
                mesh.normals.push((mesh.normals[i] + mesh.normals[j]).normalize_or_zero());
                if !mesh.tangents.is_empty() {
                    let sum = mesh.tangents[i].truncate() + mesh.tangents[j].truncate();
                    mesh.tangents.push(sum.normalize_or_zero().extend(mesh.tangents[i].w));
                }
                if !mesh.uvs.is_empty() {
                    mesh.uvs.push(0.5 * (mesh.uvs[i] + mesh.uvs[j]));
                }
                if let Some(open) = &mut open {
                    open.push(0.5 * (open[i] + open[j]));
                }
                mesh.positions.len() as u32 - 1
            })
        };
        for [a, b, c] in self.mesh.triangles.iter().copied() {
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        mesh.triangles = triangles;
        Self { mesh, open }
    }

    /// The scene with this mesh, sampled.
    fn evaluated(&self, bench: &Bench<'_>, silhouette: Silhouette) -> Result<Evaluated, StudyError> {
        let mut scene = bench.scene(Settings { silhouette, ..bench.settings() });
        let PosedMesh { positions, normals, tangents, uvs, triangles } = self.mesh.clone();
        scene.mesh = Mesh { positions, normals, tangents, uvs, triangles, ..Mesh::default() };
        let occlusion = self.open.clone().map(|base| VertexOcclusion { base, morphs: Vec::new() });
        let samples =
            samples::sample_views(&scene, &self.mesh, occlusion.as_ref()).map_err(PrepareError::from)?;
        Ok(Evaluated { scene, illumination: bench.prepared.illumination.clone(), samples })
    }

    fn images(&self, bench: &Bench<'_>, silhouette: Silhouette) -> Result<Vec<Image>, StudyError> {
        Ok(self.evaluated(bench, silhouette)?.images(&bench.point()))
    }

    fn setting(
        &self,
        bench: &Bench<'_>,
        silhouette: Silhouette,
        exact: &[Image],
        own: bool,
    ) -> Result<Setting, StudyError> {
        let evaluated = self.evaluated(bench, silhouette)?;
        let scene = &evaluated.scene;
        let edge = self.edge() * scene.metres_per_unit;
        let facts = Facts::of_scene(scene, &bench.point().params, Budget::Exact, false);
        let name = match silhouette {
            Silhouette::Vertex => format!("vertex, edges of {:.1} mm", 1e3 * edge),
            _ => silhouette.name().to_owned(),
        };
        Ok(Setting {
            name,
            choose: own.then_some(Choose::Silhouette(silhouette)),
            error: Difference::of_all(exact, &evaluated.images(&bench.point())),
            cost: plan(&facts)?.cost,
            time: None,
            counts: vec![
                ("triangles", self.mesh.triangles.len() as f64),
                ("edge, mm", 1e3 * edge),
                ("sag", tessellation_error(scene)),
            ],
            reference: silhouette == Silhouette::Fragment,
            front: false,
        })
    }

    /// The median length of an edge.
    fn edge(&self) -> f64 {
        let place = |i: u32| self.mesh.positions[i as usize];
        let mut lengths: Vec<f64> = self
            .mesh
            .triangles
            .iter()
            .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
            .map(|(a, b)| f64::from(place(a).distance(place(b))))
            .collect();
        let middle = lengths.len() / 2;
        if lengths.is_empty() { 0.0 } else { *lengths.select_nth_unstable_by(middle, f64::total_cmp).1 }
    }
}
