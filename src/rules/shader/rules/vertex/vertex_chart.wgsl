// The chart of the UV atlas, the same at all corners of a triangle.
//
// gives: vertex_chart
// cost: 0
fn chart_of_vertex(rest_chart: f32) -> f32 {
    return rest_chart;
}
