// Skin shading constants, exported by skinfit VERSION from params.toml.
// Scene: scene.toml
// Loss: relative_l2, 1.230000e-2 at the end of the fit
// Standard error of rim_exponent: 4.00e-3
//
// Comments cite the listings of GPU Gems, chapter 3, and sections of docs/model.md, a page of skinfit.
//
// Call skinfit_shade with what the vertex stage hands over, in world space:
// - vertex_uv: texture coordinates, origin at the image's top left
// - vertex_occlusion: open share of the hemisphere, 1 = unoccluded
// - vertex_normal: normal, as interpolated
// - vertex_position: position
// - vertex_tangent: tangent, as interpolated
// - vertex_bitangent: bitangent w cross(N, T), as interpolated
// - eye: position of the eye
//
// It reads what `skinfit bake --params` writes of the scene, seamless and without mip levels:
// - skinfit_irradiance_cube: irradiance / pi of the environment (irradiance.exr)
// - skinfit_specular_cube: Phong lobe of exponent 32.0, luminance in alpha (specular.exr, or lobe_<exponent>.exr)
// - skinfit_hilite_cube: the environment (hilite.exr)
// - skinfit_color_map: the scene's colour map, decoded from sRGB
// - skinfit_normal_map: the scene's normal map as stored, +Y up
// - skinfit_specular_map: the scene's specular map, linear
// - skinfit_attenuator_map: the scene's attenuator map, linear

#include <metal_stdlib>
using namespace metal;
constant float3 SKINFIT_BASE_WEIGHT = float3(1.0, 1.0, 1.0);
constant float3 SKINFIT_RIM_WEIGHT = float3(0.5, 0.5, 0.5);
constant float SKINFIT_RIM_EXPONENT = 2.0;
constant float3 SKINFIT_HILITE = float3(0.7, 0.7, 0.7);
constant float3 SKINFIT_REFLECTION = float3(0.02, 0.02, 0.02);
constant float3 SKINFIT_SIDE_SPECULAR = float3(1.0, 1.0, 1.0);
constant float SKINFIT_OCCLUSION = 1.0;
constant float SKINFIT_NORMAL_STRENGTH = 1.0;

// Textures and samplers, and the functions that read them.
struct Skinfit {
    texturecube<float> skinfit_irradiance_cube;
    texturecube<float> skinfit_specular_cube;
    texturecube<float> skinfit_hilite_cube;
    texture2d<float> skinfit_color_map;
    texture2d<float> skinfit_normal_map;
    texture2d<float> skinfit_specular_map;
    texture2d<float> skinfit_attenuator_map;
    sampler skinfit_map_sampler;
    sampler skinfit_cube_sampler;

    // Whether no component is NaN or infinite, asked in a way that compilers do not assume away.
    bool skinfit_is_finite(float3 v) {
        uint3 bits = as_type<uint3>(v) & uint3(0x7f800000u);
        return bits.x != 0x7f800000u && bits.y != 0x7f800000u && bits.z != 0x7f800000u;
    }

    // Whether every component is 0.
    bool skinfit_is_zero(float3 v) {
        return v.x == 0.0 && v.y == 0.0 && v.z == 0.0;
    }

    // v / |v| without under- or overflow; the fallback where v is zero or not finite (docs/model.md section 7).
    float3 skinfit_normalize_or(float3 v, float3 fallback) {
        float largest = max(max(abs(v.x), abs(v.y)), abs(v.z));
        // Below 1e-37 the reciprocal would overflow; such a vector is noise.
        bool ok = largest >= 1e-37 && skinfit_is_finite(v);
        float3 u = (ok ? v / (ok ? largest : 1.0) : float3(1.0, 0.0, 0.0));
        return (ok ? u / sqrt(dot(u, u)) : fallback);
    }

    // S.z to a power, with 0^p = 0 and 0^0 = 1 (docs/model.md sections 3 and 7).
    float skinfit_rim_power(float silhouette, float rim_exponent) {
        // The smallest positive normal f32; below it the power is 0 for any exponent of the table's bounds.
        bool positive = silhouette >= 1.2e-38;
        float power = exp2(rim_exponent * log2((positive ? silhouette : 1.0)));
        return (positive ? power : (rim_exponent > 0.0 ? 0.0 : 1.0));
    }

    // Albedo, linear Rec.709, filtered by the hardware; stored in 8 bits.
    float3 skinfit_albedo_from_map(float2 vertex_uv) {
        return skinfit_color_map.sample(skinfit_map_sampler, vertex_uv, level(0.0)).rgb;
    }

    // The hilite attenuator a, filtered by the hardware; stored in 8 bits.
    float skinfit_attenuator_from_map(float2 vertex_uv) {
        return skinfit_attenuator_map.sample(skinfit_map_sampler, vertex_uv, level(0.0)).r;
    }

    // The normal map's texel, in [0, 1], filtered by the hardware; stored in 8 bits.
    float3 skinfit_normal_texel_from_map(float2 vertex_uv) {
        return skinfit_normal_map.sample(skinfit_map_sampler, vertex_uv, level(0.0)).xyz;
    }

    // The side-specular intensity s, filtered by the hardware; stored in 8 bits.
    float skinfit_specular_from_map(float2 vertex_uv) {
        return skinfit_specular_map.sample(skinfit_map_sampler, vertex_uv, level(0.0)).r;
    }

    // 2 rgb - 1 (docs/model.md section 3, corrected form). A texel that is not finite or decodes to nothing is the smooth normal
    // (docs/model.md section 7); a positive z never vanishes, so that the normal does not either.
    float3 skinfit_decode_texel(float3 normal_texel) {
        float3 d = 2.0 * normal_texel - 1.0;
        if (skinfit_is_zero(d) || !skinfit_is_finite(d)) {
            return float3(0.0, 0.0, 1.0);
        }
        return float3(d.xy, (d.z >= 0.0 && d.z < 1e-6 ? 1e-6 : d.z));
    }

    // occ = 1 - occlusion (1 - S.x) (docs/model.md section 3).
    float skinfit_occluded_share(float open, float occlusion) {
        return 1.0 - occlusion * (1.0 - open);
    }

    // V, from the eye to the surface, re-normalised (docs/model.md section 3, corrected form).
    float3 skinfit_view_exact(float3 vertex_position, float3 eye) {
        return skinfit_normalize_or(vertex_position - eye, float3(0.0, 0.0, -1.0));
    }

    // The part of the shading normal that the normal map's strength leaves alone.
    float3 skinfit_base_of_texel(float3 decoded, float3 vertex_normal, float3 view) {
        float3 base = decoded.z * vertex_normal;
        return (abs(base.x) + abs(base.y) + abs(base.z) < 1e-37 || !skinfit_is_finite(base) ? -view : base);
    }

    // S.w: light that falls through leaves from +Z (listing 3-3 with the identity as DappleXf).
    float skinfit_dapple_from_ahead(float3 dapple_normal) {
        return dapple_normal.z;
    }

    // The smooth normal N of unit length; +Z where it vanishes, whatever the eye sees. That needs no V, and
    // nearly no mesh has such a fragment.
    float3 skinfit_smooth_normal_unguarded(float3 vertex_normal) {
        return skinfit_normalize_or(vertex_normal, float3(0.0, 0.0, 1.0));
    }

    // S.w clamped at 0 (docs/model.md section 3, corrected form).
    float skinfit_clamped_dapple(float dapple_cosine) {
        return max(dapple_cosine, 0.0);
    }

    // S.z = 1 - |N.V| from the smooth normal at the fragment (docs/model.md section 2).
    float skinfit_silhouette_smooth(float3 normal, float3 view) {
        return 1.0 - min(abs(dot(normal, view)), 1.0);
    }

    // The part of the shading normal that the normal map's strength scales.
    float3 skinfit_bump_of_texel(float3 decoded, float3 vertex_tangent, float3 vertex_bitangent) {
        float3 bump = decoded.x * vertex_tangent + decoded.y * vertex_bitangent;
        return (skinfit_is_finite(bump) ? bump : float3(0.0));
    }

    // E_h(V), the light behind the rim; filtered by the hardware.
    float3 skinfit_hilite_light_from_cube(float3 view_in_environment) {
        return skinfit_hilite_cube.sample(skinfit_cube_sampler, view_in_environment, level(0.0)).rgb;
    }

    // rim = S.z ^ rim_exponent (docs/model.md section 3).
    float skinfit_rim_of_silhouette(float silhouette, float rim_exponent) {
        return skinfit_rim_power(silhouette, rim_exponent);
    }

    // The hilite: a E_h(V) (docs/model.md section 3).
    float3 skinfit_attenuated_hilite(float attenuator, float3 hilite_light) {
        return attenuator * hilite_light;
    }

    // n = normalize(TBN decode(t, normal_strength)) (docs/model.md section 3); without a direction the smooth normal, and
    // without that -V (docs/model.md section 7).
    float3 skinfit_bumped_normal(float3 base, float3 bump, float3 normal, float3 view, float normal_strength) {
        return skinfit_normalize_or(base + normal_strength * bump, skinfit_normalize_or(normal, -view));
    }

    // hilite occ rim a E_h(V): back light that shines past the rim (docs/model.md section 3).
    float3 skinfit_back_light(float3 hilite_term, float occ, float rim, float3 hilite) {
        return hilite * (occ * rim) * hilite_term;
    }

    // R = V - 2 n (n.V) (docs/model.md section 3, corrected form).
    float3 skinfit_mirror_direction(float3 lookup_normal, float3 view) {
        return view - 2.0 * dot(lookup_normal, view) * lookup_normal;
    }

    // E_d(n), the irradiance; filtered by the hardware.
    float3 skinfit_irradiance_from_cube(float3 n_in_environment) {
        return skinfit_irradiance_cube.sample(skinfit_cube_sampler, n_in_environment, level(0.0)).rgb;
    }

    // E_s(n), what shines from the side; filtered by the hardware.
    float3 skinfit_side_light_from_cube(float3 n_in_environment) {
        return skinfit_specular_cube.sample(skinfit_cube_sampler, n_in_environment, level(0.0)).rgb;
    }

    // The diffuse light: albedo E_d(n), before occlusion and weights (docs/model.md section 3).
    float3 skinfit_albedo_times_irradiance(float3 albedo, float3 irradiance) {
        return albedo * irradiance;
    }

    // E_s(R), the mirrored environment; filtered by the hardware.
    float4 skinfit_mirror_light_from_cube(float3 reflected_in_environment) {
        return skinfit_specular_cube.sample(skinfit_cube_sampler, reflected_in_environment, level(0.0)).rgba;
    }

    // Light from the side: s E_s(n) (docs/model.md section 3).
    float3 skinfit_side_specular_term(float specular, float3 side_light) {
        return specular * side_light;
    }

    // diffuse (base_weight + rim_weight rim) (docs/model.md section 3).
    float3 skinfit_diffuse_light(float3 diffuse_term, float occ, float rim, float3 base_weight, float3 rim_weight) {
        return diffuse_term * (occ * (base_weight + rim * rim_weight));
    }

    // The mirrored light: dapple E_s(R).rgb (docs/model.md section 3).
    float3 skinfit_dappled_mirror(float dapple, float4 mirror_light) {
        return dapple * mirror_light.rgb;
    }

    // side_specular side (docs/model.md section 3).
    float3 skinfit_side_specular_light(float3 side_term, float3 side_specular) {
        return side_specular * side_term;
    }

    // reflection dapple E_s(R).rgb (docs/model.md section 3).
    float3 skinfit_mirrored_light(float3 mirror_term, float3 reflection) {
        return reflection * mirror_term;
    }

    // What the vertex stage hands over: world space, interpolated.
    struct SkinfitSurface {
        float2 vertex_uv;
        float vertex_occlusion;
        float3 vertex_normal;
        float3 vertex_position;
        float3 vertex_tangent;
        float3 vertex_bitangent;
        float3 eye;
    };

    // Linear Rec.709 radiance, and 1 in alpha.
    float4 skinfit_shade(SkinfitSurface at) {
        float3 albedo = skinfit_albedo_from_map(at.vertex_uv);
        float attenuator = skinfit_attenuator_from_map(at.vertex_uv);
        float3 normal_texel = skinfit_normal_texel_from_map(at.vertex_uv);
        float open = at.vertex_occlusion;
        float specular = skinfit_specular_from_map(at.vertex_uv);
        float3 dapple_normal = at.vertex_normal;
        float3 decoded = skinfit_decode_texel(normal_texel);
        float occ = skinfit_occluded_share(open, SKINFIT_OCCLUSION);
        float3 view = skinfit_view_exact(at.vertex_position, at.eye);
        float3 base = skinfit_base_of_texel(decoded, at.vertex_normal, view);
        float dapple_cosine = skinfit_dapple_from_ahead(dapple_normal);
        float3 normal = skinfit_smooth_normal_unguarded(at.vertex_normal);
        float3 view_in_environment = view;
        float dapple = skinfit_clamped_dapple(dapple_cosine);
        float silhouette = skinfit_silhouette_smooth(normal, view);
        float3 bump = skinfit_bump_of_texel(decoded, at.vertex_tangent, at.vertex_bitangent);
        float3 hilite_light = skinfit_hilite_light_from_cube(view_in_environment);
        float rim = skinfit_rim_of_silhouette(silhouette, SKINFIT_RIM_EXPONENT);
        float3 hilite_term = skinfit_attenuated_hilite(attenuator, hilite_light);
        float3 n = skinfit_bumped_normal(base, bump, normal, view, SKINFIT_NORMAL_STRENGTH);
        float3 hilite_part = skinfit_back_light(hilite_term, occ, rim, SKINFIT_HILITE);
        float3 lookup_normal = n;
        float3 n_in_environment = lookup_normal;
        float3 reflected = skinfit_mirror_direction(lookup_normal, view);
        float3 reflected_in_environment = reflected;
        float3 irradiance = skinfit_irradiance_from_cube(n_in_environment);
        float3 side_light = skinfit_side_light_from_cube(n_in_environment);
        float3 diffuse_term = skinfit_albedo_times_irradiance(albedo, irradiance);
        float4 mirror_light = skinfit_mirror_light_from_cube(reflected_in_environment);
        float3 side_term = skinfit_side_specular_term(specular, side_light);
        float3 diffuse_part = skinfit_diffuse_light(diffuse_term, occ, rim, SKINFIT_BASE_WEIGHT, SKINFIT_RIM_WEIGHT);
        float3 mirror_term = skinfit_dappled_mirror(dapple, mirror_light);
        float3 side_part = skinfit_side_specular_light(side_term, SKINFIT_SIDE_SPECULAR);
        float3 mirror_part = skinfit_mirrored_light(mirror_term, SKINFIT_REFLECTION);
        return float4(diffuse_part + side_part + hilite_part + mirror_part, 1.0);
    }
};
