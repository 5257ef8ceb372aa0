// Schlick's Fresnel factor on the mirrored environment (Schlick 1994).
//
// effect: fresnel_reflection, the mirrored environment grows towards grazing angles
// parameter: fresnel_weight = 0.5 in [0, inf), rgb, linear, weighs fresnel_reflection; weight of the mirrored environment; Schlick 1994
// parameter: fresnel_f0 = 0.028 in [0, 0.2]; reflectance when facing; Schlick 1994
//
// gives: fresnel_part
// adds: fresnel_reflection
// cost: 16
fn fresnel_light(n: vec3f, view: vec3f, mirror_light: vec4f, fresnel_weight: vec3f, fresnel_f0: f32) -> vec3f {
    let grazing: f32 = 1.0 - min(abs(dot(n, view)), 1.0);
    let square: f32 = grazing * grazing;
    let share: f32 = fresnel_f0 + (1.0 - fresnel_f0) * (square * square * grazing);
    return fresnel_weight * (share * mirror_light.rgb);
}
