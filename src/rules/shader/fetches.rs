//! A plan whose fragments fetch what they read and do nothing else.

use super::domain::Domain;
use super::emit::Plan;
use super::facts::ShadowFacts;
use super::quantity::{Kind, Resource};
use super::rule::Rule;
use crate::model::shadow_filter::ShadowFilter;

impl Plan {
    /// This plan with a fragment stage that fetches the same textures, as often, and does nothing else:
    /// what a frame costs at the least.
    #[must_use]
    pub fn fetches_alone(&self) -> Self {
        let plan = Self { only_fetches: true, ..self.clone() };
        let wgsl = plan.raster_module();
        Self { wgsl, ..plan }
    }

    /// The sum of what it fetches.
    pub(super) fn fetches(&self) -> String {
        let filter = self.facts.maps.filter;
        let (map, texels) = if filter.reads_levels() {
            let steps = "vec4f(dpdx(at.vertex_uv), dpdy(at.vertex_uv))";
            let texels = format!("sample_mip_texels({{t}}, at.vertex_uv, {steps}, {}.0)", filter.most_taps());
            ("textureSample({t}, map_sampler, at.vertex_uv)", texels)
        } else {
            let map = "textureSampleLevel({t}, map_sampler, at.vertex_uv, 0.0)";
            (map, "sample_texels({t}, at.vertex_uv)".to_owned())
        };
        let fetches: Vec<String> = self
            .steps
            .iter()
            .filter(|step| step.rule.domain == Domain::Fragment)
            .filter_map(|step| {
                let read = |kind| {
                    let found = |r: &&Resource| step.rule.reads.contains(&r.name()) && r.kind() == kind;
                    self.resources.iter().find(found).map(|r| r.name())
                };
                let direction = if step.rule.needs.iter().any(|(name, _)| name.starts_with("reflected")) {
                    "at.vertex_normal.zxy"
                } else {
                    "at.vertex_normal"
                };
                let fetch = |kind, lookup: &str| Some(lookup.replace("{t}", read(kind)?));
                fetch(Kind::Cube, &format!("textureSampleLevel({{t}}, cube_sampler, {direction}, 0.0)"))
                    .or_else(|| fetch(Kind::Map, map))
                    .or_else(|| {
                        fetch(
                            Kind::Faces,
                            &format!("sample_faces({{t}}, {{t}}_size(), cube_place({direction}))"),
                        )
                    })
                    .or_else(|| fetch(Kind::Texels, &texels))
            })
            .chain(self.shadow_fetches())
            .collect();
        if fetches.is_empty() { "vec4f(0.0)".to_owned() } else { fetches.join(" + ") }
    }

    /// As many fetches as the filter of shadow maps makes for a light, around where its map shows a place.
    pub(super) fn shadow_fetch(&self) -> String {
        let Some(ShadowFacts { filter, taps }) = self.facts.shadows else { return String::new() };
        if self.shadow_fetches().next().is_none() {
            return String::new();
        }
        let taps = if filter == ShadowFilter::Hardware { 1 } else { taps };
        let blockers = match filter {
            ShadowFilter::Pcss => {
                "        let texel = vec2i(clamp(at, vec2f(0.0), vec2f(0.999)) * shadow_row(layer, 6u).w);\n        \
                 sum += textureLoad(shadow_maps, texel, layer, 0);\n"
            }
            _ => "",
        };
        format!(
            "\nfn shadow_fetch(light: u32, place: vec3f) -> f32 {{\n    \
             let layer = min(light, textureNumLayers(shadow_maps) - 1u);\n    \
             let seen = shadow_seen(layer, place);\n    var sum = 0.0;\n    \
             for (var i = 0u; i < {taps}u; i++) {{\n        \
             let at = seen.xy + vec2f(f32(i % 4u), f32(i / 4u)) / shadow_row(layer, 6u).w;\n        \
             sum += textureSampleCompareLevel(shadow_maps, shadow_sampler, at, layer, seen.z);\n{blockers}    \
             }}\n    return sum;\n}}\n"
        )
    }

    /// Calls of that for each light that fragments compare with its map.
    fn shadow_fetches(&self) -> impl Iterator<Item = String> {
        let compares = |rule: &&Rule| rule.reads.contains(&Resource::ShadowMaps.name());
        let lights = self.rules(Domain::Fragment).filter(compares).count();
        (0..lights).map(|light| format!("vec4f(shadow_fetch({light}u, at.vertex_position))"))
    }
}
