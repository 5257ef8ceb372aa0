//! What a fit's state belongs to: everything that the model and its targets are made from, as it was read. Nothing that
//! an engine computes is in it, so a fit goes on wherever its passes and its samples are made.

use crate::fit::fingerprint::Fingerprint;
use crate::model::effects::Effect;
use crate::prepare::HeldOut;
use crate::scene::maps::{Environment, Map, Maps, OwnMap};
use crate::scene::mesh::Mesh;
use crate::scene::plain::Alpha;
use crate::scene::view::Target;
use crate::scene::{Quality, Scene};

/// What stands for something that is not there.
const NONE: &str = "none";

/// The fingerprint of a fit of `scene` without the views that are held out.
/// Cameras that a fit moved first count as it left them, as the scene in its folder has them.
pub(super) fn fingerprint(scene: &Scene, held: &HeldOut) -> Fingerprint {
    let effects: Vec<&str> = scene.effects.iter().map(Effect::name).collect();
    let Maps { color, normal, specular, attenuator, own, .. } = &scene.maps;
    let read = Fingerprint::default()
        .with("form", scene.form.name())
        .with("silhouette", scene.silhouette.name())
        .with("lookups", scene.lookups.name());
    // What shows nothing is the same with either choice.
    let shows = |key: &str| key != "skin_reflection" || scene.reflects_skin();
    let all = (scene.choices.named().into_iter())
        .filter(|(key, _)| shows(key))
        .fold(read, |all, (key, name)| all.with(key, name))
        .with("dapple", format!("{:?}", scene.dapple))
        .with("list of effects", effects.join(" "))
        .with("loss", scene.fit.loss.name())
        .with("color map", map(color.as_ref()))
        .with("normal map", map(normal.as_ref()))
        .with("specular map", map(specular.as_ref()))
        .with("attenuator map", map(attenuator.as_ref()))
        .with("environment", environment(scene.environment.as_ref()))
        .with("mesh or its pose", mesh(&scene.mesh, scene.metres_per_unit))
        .with("quality", quality(scene.quality));
    let lit = scene.effects.has(Effect::Lights);
    let lights = lit.then(|| Hash::default().words(&scene.lights).words(&scene.sky_lights).done());
    let all = lights.into_iter().fold(all, |all, lights| all.with("lights", lights));
    // Of states that were kept before there was a choice, none has another filter.
    let filter = Some(scene.quality.texture_filter).filter(|filter| filter.reads_levels());
    let all = filter.into_iter().fold(all, |all, filter| all.with("texture filter", filter.name()));
    // Nothing else knows of the atlas' texels.
    let texels = scene.needs().atlas.then_some(scene.diffusion.light_map_size);
    let all = texels.into_iter().fold(all, |all, size| all.with("light map", size.to_string()));
    let all = crate::shader::term::enabled(scene.effects).fold(all, |all, term| {
        all.with(
            format!("rules of the effect {}", term.effect.name()),
            Hash::default().words(&term.text).done(),
        )
    });
    let all = own.iter().fold(all, |all, (field, texels)| {
        let texels = match texels {
            OwnMap::Scalar(texels) => map(Some(texels)),
            OwnMap::Color(texels) => map(Some(texels)),
        };
        all.with(format!("map {}", field.name()), texels)
    });
    let within = scene.fit.bounds.iter().map(|(param, [a, b])| format!("{} in [{a}, {b}]", param.name()));
    let within = within.collect::<Vec<_>>().join(", ");
    let all = if within.is_empty() { all } else { all.with("bounds", within) };
    let held: Vec<&str> = held.views.iter().map(|view| view.name.as_str()).collect();
    let all = if held.is_empty() { all } else { all.with("list of held-out views", held.join(" ")) };
    scene.views.iter().fold(all, |all, view| {
        let camera = Hash::default().words(&view.camera).done();
        all.with(format!("camera of view {}", view.name), camera)
            .with(format!("target of view {}", view.name), target(view.target.as_ref()))
    })
}

/// A hash under way.
#[derive(Default)]
struct Hash(blake3::Hasher);

impl Hash {
    /// Numbers, and how many there are.
    fn numbers<T: bytemuck::NoUninit>(mut self, numbers: &[T]) -> Self {
        self.0.update(&(numbers.len() as u64).to_le_bytes());
        self.0.update(bytemuck::cast_slice(numbers));
        self
    }

    /// What `Debug` says, which tells every bit of a number.
    fn words(mut self, value: &impl std::fmt::Debug) -> Self {
        self.0.update(format!("{value:?};").as_bytes());
        self
    }

    fn done(self) -> String {
        self.0.finalize().to_hex()[..16].to_owned()
    }
}

fn map<const C: usize>(map: Option<&Map<C>>) -> String {
    map.map_or_else(
        || NONE.to_owned(),
        |map| Hash::default().words(&[map.width, map.height]).numbers(map.texels.as_flattened()).done(),
    )
}

fn environment(environment: Option<&Environment>) -> String {
    // What became lights stands by itself.
    let Some(Environment { panorama, rotation_degrees, intensity, spots: _ }) = environment else {
        return NONE.to_owned();
    };
    let of = Hash::default().words(&[panorama.width, panorama.height]).words(&[rotation_degrees, intensity]);
    of.numbers(panorama.texels.as_flattened()).done()
}

fn mesh(mesh: &Mesh, metres_per_unit: f64) -> String {
    let flat =
        |vectors: &[glam::Vec3]| -> Vec<f32> { vectors.iter().flat_map(glam::Vec3::to_array).collect() };
    let tangents: Vec<f32> = mesh.tangents.iter().flat_map(glam::Vec4::to_array).collect();
    let uvs: Vec<f32> = mesh.uvs.iter().flat_map(glam::Vec2::to_array).collect();
    let bones: Vec<f32> = mesh.bones.iter().flat_map(glam::Mat4::to_cols_array).collect();
    let rest = Hash::default()
        .words(&metres_per_unit)
        .numbers(&flat(&mesh.positions))
        .numbers(&flat(&mesh.normals))
        .numbers(&tangents)
        .numbers(&uvs)
        .numbers(mesh.triangles.as_flattened())
        .numbers(mesh.joints.as_flattened())
        .numbers(mesh.weights.as_flattened())
        .numbers(&bones);
    // What a scene asks for that has two sets of texture coordinates stands behind what all have.
    let rest = match &*mesh.own_atlas_uvs {
        [] => rest,
        own => rest.numbers(&own.iter().flat_map(glam::Vec2::to_array).collect::<Vec<f32>>()),
    };
    let rest = mesh.fields.iter().fold(rest, |all, of| all.words(&of.field).numbers(&of.numbers));
    // Which triangles are no skin, and which of those have holes: pixels that show them do not count.
    let rest = mesh.plain.iter().fold(rest, |all, plain| {
        let colors = plain.corner_colors.as_flattened().as_flattened();
        let all = all.words(&plain.of_triangle).numbers(colors);
        plain.materials.iter().fold(all, |all, of| {
            let all = all.words(&(of.alpha, of.base_color[3]));
            match of.color_map.as_ref().filter(|_| of.alpha != Alpha::Opaque) {
                Some(map) => all.words(&(map.wrap, map.nearest)).numbers(map.map.texels.as_flattened()),
                None => all,
            }
        })
    });
    // A target without weight moves nothing, and its occlusion is not baked.
    let moved = mesh.morphs.iter().filter(|morph| morph.weight != 0.0);
    moved
        .fold(rest, |all, morph| {
            all.words(&morph.weight).numbers(&flat(&morph.positions)).numbers(&flat(&morph.normals))
        })
        .done()
}

fn quality(quality: Quality) -> String {
    let Quality {
        samples_per_axis,
        irradiance_size,
        lobe_size,
        hilite_size,
        lobes_per_octave,
        occlusion_rays,
        shadow_rays,
        sky_rays,
        lobe_rays,
        texture_filter: _,
    } = quality;
    format!(
        "samples_per_axis {samples_per_axis}, irradiance_size {irradiance_size}, lobe_size {lobe_size}, hilite_size \
         {hilite_size}, lobes_per_octave {lobes_per_octave}, occlusion_rays {occlusion_rays}, \
         shadow_rays {shadow_rays}, sky_rays {sky_rays}, lobe_rays {lobe_rays}"
    )
}

fn target(target: Option<&Target>) -> String {
    let Some(Target { rgb, alpha, haze, mask, clipped_at }) = target else { return NONE.to_owned() };
    let of = Hash::default().words(clipped_at).numbers(rgb.as_flattened());
    [alpha, mask, haze]
        .into_iter()
        .fold(of, |all, plane| all.words(&plane.is_some()).numbers(plane.as_deref().unwrap_or_default()))
        .done()
}
