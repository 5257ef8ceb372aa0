// The root of what a white furnace does not give back.
fn kelemen_lost(x: f32, y: f32) -> f32 {
    let n0: f32 = 0.05032842 + y * (0.92823243 + y * (0.244058 + y * (-3.581411 + y * (20.056583 + y * (-12.983286 + y * 19.232962)))));
    let n1: f32 = 0.63196075 + y * (11.220551 + y * (0.50528 + y * (245.63412 + y * (7.7821164 + y * -35.406467))));
    let n2: f32 = 10.755723 + y * (-129.8004 + y * (1503.7479 + y * (-560.39246 + y * 19.443981)));
    let n3: f32 = -85.66708 + y * (2208.5225 + y * (-3115.6768 + y * 294.96945));
    let n4: f32 = 824.0452 + y * (-3665.7708 + y * 1616.4609);
    let n5: f32 = -1377.1492 + y * 1575.2023;
    let n6: f32 = 627.4176;
    let d0: f32 = 1.0 + y * (0.011878415 + y * (-2.2511764 + y * (14.3549795 + y * (-2.4677527 + y * (4.8691344 + y * 14.604351)))));
    let d1: f32 = 3.4925187 + y * (49.818325 + y * (33.24776 + y * (262.0244 + y * (-22.340408 + y * -14.5973625))));
    let d2: f32 = 4.166834 + y * (93.36069 + y * (1902.7306 + y * (-809.7199 + y * 100.92278)));
    let d3: f32 = 79.9858 + y * (2238.5825 + y * (-2937.882 + y * 329.9022));
    let d4: f32 = 630.4223 + y * (-3159.4087 + y * 1072.9104);
    let d5: f32 = -1145.277 + y * 952.00574;
    let d6: f32 = 447.8935;
    return (n0 + x * (n1 + x * (n2 + x * (n3 + x * (n4 + x * (n5 + x * n6)))))) / (d0 + x * (d1 + x * (d2 + x * (d3 + x * (d4 + x * (d5 + x * d6))))));
}

// 1 - H.V' in the mean of its fifth power.
fn kelemen_mean(x: f32, y: f32) -> f32 {
    let n0: f32 = 0.013207513 + y * (0.84576565 + y * (-4.2553053 + y * (39.519253 + y * (75.719925 + y * -9.772813))));
    let n1: f32 = 21.472048 + y * (-38.136597 + y * (518.7296 + y * (357.24658 + y * -63.586205)));
    let n2: f32 = -25.9702 + y * (1187.3373 + y * (-1342.7145 + y * -268.05554));
    let n3: f32 = 189.33792 + y * (-225.99495 + y * 665.7897);
    let n4: f32 = 94.60431 + y * -620.4435;
    let n5: f32 = -207.34804;
    let d0: f32 = 1.0 + y * (16.555592 + y * (-37.52728 + y * (260.61157 + y * (334.3989 + y * -48.35474))));
    let d1: f32 = 18.619137 + y * (-37.40188 + y * (1341.6755 + y * (-621.68005 + y * -173.48753)));
    let d2: f32 = -13.514137 + y * (1351.9233 + y * (-1997.9249 + y * 301.39133));
    let d3: f32 = 180.1531 + y * (-344.33215 + y * 681.2854);
    let d4: f32 = 95.731384 + y * -636.7924;
    let d5: f32 = -207.85982;
    return (n0 + x * (n1 + x * (n2 + x * (n3 + x * (n4 + x * n5))))) / (d0 + x * (d1 + x * (d2 + x * (d3 + x * (d4 + x * d5)))));
}

// The split sum of kelemen (MODEL 9): a and b, with which a constant environment of 1 is reflected as f0 a + b, at
// N.V' and a roughness of [0.05, 1], to 2e-4. At views that graze more than 1e-6 it stays: there
// its slope is infinite. Fitted to the exact integrals and printed by specular/fitted.rs; nobody writes here.
fn split_sum_kelemen(view_cosine: f32, roughness: f32) -> vec2f {
    let view: f32 = max(view_cosine, 1e-6);
    let y: f32 = 1.0526316 * roughness - 0.05263158;
    let lost_layer: f32 = 2.0 * roughness;
    let lost: f32 = kelemen_lost(1.0 - sqrt(view * (1.0 + lost_layer) / (view + lost_layer)), y);
    let mean_layer: f32 = 2.0 * roughness;
    let mean: f32 = max(kelemen_mean(1.0 - sqrt(view * (1.0 + mean_layer) / (view + mean_layer)), y), 0.0);
    let all: f32 = 1.0 - lost * lost;
    let square: f32 = mean * mean;
    let grazing: f32 = all * (square * square * mean);
    return vec2f(all - grazing, grazing);
}
