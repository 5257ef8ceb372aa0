// Specular light with a Fresnel term, of lamps and of the environment, and what it leaves for the diffuse light
// (MODEL 9 and 12).
//
// effect: fresnel asks environment shares light bakes environment, the environment and the skin itself in the skin's specular lobe; what it reflects the diffuse light lacks
// effect: light_specular upon lights asks lights, the lights in the skin's specular lobe
// parameter: specular_weight = 1 in [0, inf), rgb, linear, weighs fresnel, weighs light_specular; weight of specular light; Kelemen and Szirmay-Kalos 2001
// parameter: roughness = 0.35 in [0.05, 1]; root mean square slope of the surface; Beckmann and Spizzichino 1963
// parameter: gloss = 0 in [0, 0.9]; how much the specular map lowers the roughness; model.md 9
// parameter: f0 = 0.028 in [0, 0.2]; reflectance when facing; Schlick 1994
// parameter: f0_floor = 0.3 in [0, 1]; share of f0 where the specular map is black, if it scales f0; model.md 9
// parameter: fresnel_loss = 1 in [0, 1], of fresnel; how much of what is reflected the diffuse light lacks; model.md 9
// sample_field: lobe_seen: f32 = 1; open share of the specular lobe, by rays
// sample_field: lobe_sharp: vec3f = 0; light of the specular lobe by rays, over what its share is, at a roughness
// sample_field: lobe_middle: vec3f = 0; the same at a greater one
// sample_field: lobe_wide: vec3f = 0; the same at the greatest
// sample_field: lobe_nodes: vec3f = 0; these roughnesses
// sample_field: skin_seen: vec3f = 0; mean radiance of the skin that a point sees, before the diffuse weights
// sample_field: normal_spread: f32 = 0; variance of the normal map's slopes below a sample, along each axis
// sample_field: bent_normal: vec3f = 0; mean direction of the open sky, as long as its share of the hemisphere

// m, the roughness that every formula takes.
//
// gives: lobe_roughness
// when: !toksvig
// cost: 4
// uses: specular
fn roughness_of_texel(roughness: f32, gloss: f32, specular: f32) -> f32 {
    return specular_roughness(roughness, gloss, specular);
}

// The listing's normal map is no map of directions.
//
// gives: lobe_roughness
// when: toksvig, listing
// cost: 4
// uses: specular
fn roughness_of_listed_texel(roughness: f32, gloss: f32, specular: f32) -> f32 {
    return specular_roughness(roughness, gloss, specular);
}

// With the bumps below the sample: the slopes' variances add, and m^2 is that of both axes.
//
// gives: lobe_roughness
// when: toksvig, corrected, kelemen
// cost: 12
// uses: specular
fn roughness_over_bumps(roughness: f32, gloss: f32, specular: f32, bump_spread: f32, normal_strength: f32) -> f32 {
    let m: f32 = specular_roughness(roughness, gloss, specular);
    return min(sqrt(m * m + 2.0 * bump_spread * (normal_strength * normal_strength)), 1.0);
}

// The same of ggx, by its alpha = m^2.
//
// gives: lobe_roughness
// when: toksvig, corrected, ggx
// cost: 20
// uses: specular
fn roughness_over_bumps_of_ggx(
    roughness: f32,
    gloss: f32,
    specular: f32,
    bump_spread: f32,
    normal_strength: f32,
) -> f32 {
    let m: f32 = specular_roughness(roughness, gloss, specular);
    let alpha: f32 = m * m;
    return min(sqrt(sqrt(alpha * alpha + 2.0 * bump_spread * (normal_strength * normal_strength))), 1.0);
}

// As the sample has it.
//
// gives: bump_spread
// when: toksvig, corrected, !raster
// cost: 0
fn spread_of_sample(normal_spread: f32) -> f32 {
    return normal_spread;
}

// The mean of unit normals is as long as 1 / (1 + the variance of their slopes) (Toksvig 2005).
//
// gives: bump_spread
// when: toksvig, corrected, raster, bumped
// cost: 10
fn spread_of_texel(decoded: vec3f) -> f32 {
    let size: f32 = clamp(sqrt(dot(decoded, decoded)), 0.1, 1.0);
    return (1.0 - size) / size;
}

// gives: bump_spread
// when: toksvig, corrected, raster, !bumped
// cost: 0
fn spread_without_bumps() -> f32 {
    return 0.0;
}

// gives: lobe_f0
// when: !f0_map
// cost: 0
fn f0_everywhere(f0: f32) -> f32 {
    return f0;
}

// f0 lerp(f0_floor, 1, s).
//
// gives: lobe_f0
// when: f0_map
// cost: 4
fn f0_of_texel(f0: f32, f0_floor: f32, specular: f32) -> f32 {
    return f0 * (f0_floor + (1.0 - f0_floor) * specular);
}

// s multiplies the specular terms.
//
// gives: lobe_weight
// when: !f0_map
// cost: 0
fn weight_of_texel(specular: f32) -> f32 {
    return specular;
}

// Where s scales f0 it multiplies nothing.
//
// gives: lobe_weight
// when: f0_map
// cost: 0
fn weight_everywhere() -> f32 {
    return 1.0;
}

// gives: view_cosine
// when: corrected
// cost: 6
fn cosine_of_view(n: vec3f, view: vec3f) -> f32 {
    return max(-dot(n, view), 0.0);
}

// The listing's normal and view are of any length.
//
// gives: view_cosine
// when: listing
// cost: 26
// uses: vector
fn cosine_of_view_as_listed(n: vec3f, view: vec3f) -> f32 {
    let none: vec3f = vec3f(0.0);
    return max(-dot(normalize_or(n, none), normalize_or(view, none)), 0.0);
}

// es = f0 a + b, what of a constant environment is reflected: the split sum of kelemen.
//
// gives: environment_share
// when: kelemen
// cost: 122
// uses: split_sum_kelemen
fn share_of_kelemen(view_cosine: f32, lobe_roughness: f32, lobe_f0: f32) -> f32 {
    let sums: vec2f = split_sum_kelemen(view_cosine, lobe_roughness);
    return lobe_f0 * sums.x + sums.y;
}

// es = f0 a + b with Schlick's Fresnel factor in the place of a dielectric's, the split sum of ggx.
//
// gives: environment_share
// when: ggx, !exact_split_sum
// cost: 122
// uses: split_sum_ggx
fn share_of_ggx(view_cosine: f32, lobe_roughness: f32, lobe_f0: f32) -> f32 {
    let sums: vec2f = split_sum_ggx(view_cosine, lobe_roughness);
    return lobe_f0 * sums.x + sums.y;
}

// es with a dielectric's Fresnel factor, which ggx has; it is not linear in f0.
//
// gives: environment_share
// when: ggx, exact_split_sum
// cost: 330
// uses: specular, split_sum_ggx, dielectric_sum_ggx
fn dielectric_share_of_ggx(view_cosine: f32, lobe_roughness: f32, lobe_f0: f32) -> f32 {
    return dielectric_sum_ggx(view_cosine, lobe_roughness, lobe_f0);
}

// What the lobe's width is told by: m of kelemen.
//
// gives: lobe_width
// when: kelemen
// cost: 0
fn width_of_kelemen(lobe_roughness: f32) -> f32 {
    return lobe_roughness;
}

// alpha of ggx.
//
// gives: lobe_width
// when: ggx
// cost: 1
fn width_of_ggx(lobe_roughness: f32) -> f32 {
    return lobe_roughness * lobe_roughness;
}

// All of the lobe is open.
//
// gives: lobe_open
// when: unoccluded_lobe
// cost: 0
fn lobe_unoccluded() -> f32 {
    return 1.0;
}

// How much of the lobe is open, by the open share of the hemisphere (Lagarde and de Rousiers 2014).
//
// gives: lobe_open
// when: lagarde_visibility
// cost: 30
// uses: specular
fn lobe_by_occlusion(view_cosine: f32, occ: f32, lobe_roughness: f32) -> f32 {
    return lagarde_visibility(view_cosine, occ, lobe_roughness);
}

// How much of the lobe is open: what its cone shares with that of the open sky (Oat and Sander 2007, Jimenez et al.
// 2016).
//
// gives: lobe_open
// when: cone_visibility
// cost: 70
// uses: specular, vector
fn lobe_by_cones(bent_normal: vec3f, n: vec3f, reflected: vec3f, occ: f32, lobe_width: f32) -> f32 {
    let bent: vec3f = normalize_or(bent_normal, n);
    // In the listing the mirrored view is of any length.
    return cone_visibility(dot(bent, normalize_or(reflected, n)), occ, lobe_width);
}

// How much of the lobe is open, by rays into it.
//
// gives: lobe_open
// when: lobe_visibility, !raster
// cost: 0
fn lobe_by_rays(lobe_seen: f32) -> f32 {
    return lobe_seen;
}

// A rasteriser has no rays: the open share of the hemisphere tells (Lagarde and de Rousiers 2014).
//
// gives: lobe_open
// when: lobe_visibility, raster
// cost: 30
// uses: specular
fn lobe_by_occlusion_of_raster(view_cosine: f32, occ: f32, lobe_roughness: f32) -> f32 {
    return lagarde_visibility(view_cosine, occ, lobe_roughness);
}

// E_r(R), the environment through the lobe, at the roughness where s = 0.
//
// gives: rough_light
// cost: 22
// uses: cube, vector
// reads: reflected_faces
fn rough_light_from_faces(lobe_place: vec3f) -> vec3f {
    return sample_faces(reflected_faces, reflected_faces_size(), lobe_place).rgb;
}

// E_r(R) at the roughness where s = 1.
//
// gives: glossy_light
// cost: 22
// uses: cube, vector
// reads: glossy_faces
fn glossy_light_from_faces(lobe_place: vec3f) -> vec3f {
    return sample_faces(glossy_faces, glossy_faces_size(), lobe_place).rgb;
}

// The same, filtered by the hardware.
//
// gives: rough_light
// cost: 12
// error: 0.004
// reads: reflected_cube, cube_sampler
fn rough_light_from_cube(lobe_direction: vec3f) -> vec3f {
    return textureSampleLevel(reflected_cube, cube_sampler, lobe_direction, 0.0).rgb;
}

// gives: glossy_light
// cost: 12
// error: 0.004
// reads: glossy_cube, cube_sampler
fn glossy_light_from_cube(lobe_direction: vec3f) -> vec3f {
    return textureSampleLevel(glossy_cube, cube_sampler, lobe_direction, 0.0).rgb;
}

// gives: lobe_light
// when: !glossy
// cost: 0
fn light_of_one_lobe(rough_light: vec3f) -> vec3f {
    return rough_light;
}

// The roughness is linear in s, and so nearly is what arrives.
//
// gives: lobe_light
// when: glossy
// cost: 6
fn light_between_lobes(rough_light: vec3f, glossy_light: vec3f, specular: f32) -> vec3f {
    return rough_light + specular * (glossy_light - rough_light);
}

// The environment is looked up along the mirrored view.
//
// gives: lobe_direction
// when: !off_peak
// cost: 0
fn lobe_at_peak(reflected_in_environment: vec3f) -> vec3f {
    return reflected_in_environment;
}

// Off the peak, where a rough lobe's mean lies (Lagarde and de Rousiers 2014).
//
// gives: lobe_mean
// when: off_peak
// cost: 24
// uses: specular, vector
fn lobe_off_peak(n: vec3f, reflected: vec3f, lobe_width: f32) -> vec3f {
    return off_peak_direction(n, normalize_or(reflected, n), lobe_width);
}

// Ry(r)^-1 d (MODEL 1).
//
// gives: lobe_direction
// when: off_peak, turned
// cost: 5
fn turned_lobe(lobe_mean: vec3f, turn: vec2f) -> vec3f {
    let d: vec3f = lobe_mean;
    return vec3f(turn.x * d.x - turn.y * d.z, d.y, turn.y * d.x + turn.x * d.z);
}

// gives: lobe_direction
// when: off_peak, !turned
// cost: 0
fn unturned_lobe(lobe_mean: vec3f) -> vec3f {
    return lobe_mean;
}

// Where the lobe meets the cubes.
//
// gives: lobe_place
// cost: 16
// uses: vector, cube
fn place_of_lobe(lobe_direction: vec3f) -> vec3f {
    return cube_place(lobe_direction);
}

// Light of the lobe by rays, between the roughnesses that were traced by the parabola through them; what is sharper
// or wider has that of the last.
//
// gives: lobe_traced
// when: traced_lobe
// cost: 36
fn light_by_rays(
    lobe_sharp: vec3f,
    lobe_middle: vec3f,
    lobe_wide: vec3f,
    lobe_nodes: vec3f,
    lobe_roughness: f32,
) -> vec3f {
    // Samples that stand for nothing have no roughnesses.
    let a: f32 = max(lobe_nodes.y - lobe_nodes.x, 0.001);
    let b: f32 = max(lobe_nodes.z - lobe_nodes.y, 0.001);
    let m: f32 = clamp(lobe_roughness, lobe_nodes.x, lobe_nodes.z) - lobe_nodes.y;
    let sharp: vec3f = (m * (m - b) / (a * (a + b))) * lobe_sharp;
    let middle: vec3f = ((m + a) * (b - m) / (a * b)) * lobe_middle;
    let wide: vec3f = (m * (m + a) / (b * (a + b))) * lobe_wide;
    return max(sharp + middle + wide, vec3f(0.0));
}

// The same before its weight: s E es.
//
// gives: lobe_term
// when: traced_lobe
// cost: 4
fn light_in_traced_lobe(lobe_traced: vec3f, lobe_weight: f32, environment_share: f32) -> vec3f {
    return (lobe_weight * environment_share) * lobe_traced;
}

// What the lobe shows of the environment before its weight: s SO E_r(R) es.
//
// gives: lobe_term
// when: !traced_lobe
// cost: 5
fn light_in_lobe(lobe_light: vec3f, lobe_weight: f32, lobe_open: f32, environment_share: f32) -> vec3f {
    return (lobe_weight * lobe_open * environment_share) * lobe_light;
}

// Where the lobe does not see the sky it is black, or rays have brought the skin's light.
//
// gives: lobe_shown
// when: !skin_reflected
// cost: 0
fn lobe_without_skin(lobe_term: vec3f) -> vec3f {
    return lobe_term;
}

// What the lobe does not see of the sky it sees of the skin: s es (1 - SO) L more, L what the point sees of it on
// average.
//
// gives: lobe_shown
// when: skin_reflected, !diffusion
// cost: 9
fn lobe_with_skin(
    lobe_term: vec3f,
    skin_seen: vec3f,
    lobe_weight: f32,
    lobe_open: f32,
    environment_share: f32,
) -> vec3f {
    return lobe_term + (lobe_weight * environment_share * (1.0 - lobe_open)) * skin_seen;
}

// The same of the light map: L is what its widest level shows here.
//
// gives: lobe_shown
// when: skin_reflected, diffusion
// cost: 12
fn lobe_with_scattered_skin(
    lobe_term: vec3f,
    diffusion_widest: vec3f,
    color_after: vec3f,
    lobe_weight: f32,
    lobe_open: f32,
    environment_share: f32,
) -> vec3f {
    return lobe_term + (lobe_weight * environment_share * (1.0 - lobe_open)) * (color_after * diffusion_widest);
}

// specular_weight s es (SO E_r(R) + (1 - SO) L).
//
// gives: fresnel_environment
// adds: fresnel
// when: fresnel
// cost: 3
fn environment_in_lobe(lobe_shown: vec3f, specular_weight: vec3f) -> vec3f {
    return specular_weight * lobe_shown;
}

// rho = specular_weight s es, what is reflected of a constant environment; never all.
//
// gives: reflected_share
// cost: 8
fn share_reflected(specular_weight: vec3f, lobe_weight: f32, environment_share: f32) -> vec3f {
    return min(specular_weight * (lobe_weight * environment_share), vec3f(1.0));
}

// What enters the skin: 1 - fresnel_loss rho.
//
// gives: entering
// when: fresnel
// cost: 6
fn share_entering(reflected_share: vec3f, fresnel_loss: f32) -> vec3f {
    return 1.0 - fresnel_loss * reflected_share;
}
