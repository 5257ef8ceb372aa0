// What each corner of a triangle counts at this one.
//
// gives: vertex_share
// cost: 0
fn share_at_corner(corner: vec3f) -> vec3f {
    return corner;
}
