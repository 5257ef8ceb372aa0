// What a fragment finds in the level: bilinear among the texels around texture coordinates that are of its chart (w); where
// none of the four is, the nearest one of the chart within four texels (MODEL 6). Without any, nothing.
fn {level}_at(uv: vec2f, chart: f32) -> vec4f {
    let at: vec2f = uv * f32({size}) - vec2f(0.5, 0.5);
    let low: vec2f = floor(at);
    let f: vec2f = at - low;
    let first: vec2i = vec2i(low);
    var sum: vec4f = vec4f(0.0, 0.0, 0.0, 0.0);
    for (var corner: i32 = 0; corner < 4; corner++) {
        let right: bool = corner == 1 || corner == 3;
        let below: bool = corner > 1;
        let texel: vec4f = {level}_near(first + vec2i(select(0, 1, right), select(0, 1, below)));
        let share: f32 = select(1.0 - f.x, f.x, right) * select(1.0 - f.y, f.y, below);
        sum += select(0.0, share, texel.w == chart) * vec4f(texel.xyz, 1.0);
    }
    if (sum.w > 0.0) {
        return vec4f(sum.xyz / sum.w, chart);
    }
    var nearest: vec4f = vec4f(0.0, 0.0, 0.0, 0.0);
    var least: f32 = 1e30;
    for (var down: i32 = -4; down <= 4; down++) {
        for (var along: i32 = -4; along <= 4; along++) {
            let place: vec2i = vec2i(round(at)) + vec2i(along, down);
            let texel: vec4f = {level}_near(place);
            let away: vec2f = vec2f(place) - at;
            let closer: bool = texel.w == chart && dot(away, away) < least;
            nearest = select(nearest, texel, closer);
            least = select(least, dot(away, away), closer);
        }
    }
    return nearest;
}
