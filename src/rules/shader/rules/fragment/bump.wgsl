// The part of the shading normal that the normal map's strength scales.
//
// gives: bump
// domain: texel, fragment
// when: bumped, raster
// cost: 10
// uses: vector
fn bump_of_texel(decoded: vec3f, vertex_tangent: vec3f, vertex_bitangent: vec3f) -> vec3f {
    let bump: vec3f = decoded.x * vertex_tangent + decoded.y * vertex_bitangent;
    return select(vec3f(0.0), bump, is_finite(bump));
}
