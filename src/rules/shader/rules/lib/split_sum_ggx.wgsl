// The root of what a white furnace does not give back.
fn ggx_lost(x: f32, y: f32) -> f32 {
    let n0: f32 = 0.123854704 + y * (2.740612 + y * (3.5632777 + y * (-6.076299 + y * (14.292728 + y * (21.897259 + y * -0.6919632)))));
    let n1: f32 = 0.03459878 + y * (0.67946917 + y * (4.5802555 + y * (2.8044958 + y * (-18.797396 + y * 20.749594))));
    let n2: f32 = -0.1654946 + y * (-4.4350986 + y * (-0.7565581 + y * (15.021135 + y * -33.136127)));
    let n3: f32 = -0.05214465 + y * (-1.5091898 + y * (-4.3290744 + y * 6.0472665));
    let n4: f32 = 0.04185391 + y * (1.8737313 + y * -2.7068534);
    let n5: f32 = 0.017514367 + y * 0.98937804;
    let n6: f32 = -0.0004120192;
    let d0: f32 = 1.0 + y * (1.5111662 + y * (31.440067 + y * (-38.168766 + y * (86.54406 + y * (-28.036684 + y * 11.477421)))));
    let d1: f32 = 2.938116 + y * (-10.776063 + y * (-0.31556824 + y * (27.656086 + y * (-85.03923 + y * 40.38964))));
    let d2: f32 = 3.2521393 + y * (-7.8058953 + y * (-24.777008 + y * (47.940353 + y * -32.95722)));
    let d3: f32 = 0.022259254 + y * (10.849422 + y * (-31.626265 + y * 22.008505));
    let d4: f32 = -2.9153898 + y * (15.843192 + y * -15.361438);
    let d5: f32 = -2.4792378 + y * 5.5059476;
    let d6: f32 = -0.73189694;
    return (n0 + x * (n1 + x * (n2 + x * (n3 + x * (n4 + x * (n5 + x * n6)))))) / (d0 + x * (d1 + x * (d2 + x * (d3 + x * (d4 + x * (d5 + x * d6))))));
}

// 1 - H.V' in the mean of its fifth power.
fn ggx_mean(x: f32, y: f32) -> f32 {
    let n0: f32 = -0.0013912567 + y * (0.36739597 + y * (-16.22698 + y * (204.95244 + y * (-329.77115 + y * (403.23367 + y * 99.87072)))));
    let n1: f32 = 402.98117 + y * (-341.66718 + y * (99.29577 + y * (1380.4232 + y * (1147.8971 + y * -78.26518))));
    let n2: f32 = -1027.6843 + y * (2724.646 + y * (-853.38617 + y * (-2819.9106 + y * -2028.784)));
    let n3: f32 = 1684.868 + y * (-3104.6565 + y * (771.69995 + y * 3107.8694));
    let n4: f32 = -958.72577 + y * (2261.705 + y * -1151.2646);
    let n5: f32 = 294.6542 + y * -570.10706;
    let n6: f32 = -51.966053;
    let d0: f32 = 1.0 + y * (37.510433 + y * (299.9503 + y * (-241.4999 + y * (-120.513466 + y * (1343.5812 + y * 655.7609)))));
    let d1: f32 = 399.00104 + y * (-487.51877 + y * (-850.04376 + y * (4104.414 + y * (488.391 + y * -2368.5022))));
    let d2: f32 = -1016.11487 + y * (3149.3064 + y * (1070.8275 + y * (-6400.9927 + y * -290.88354)));
    let d3: f32 = 1672.4937 + y * (-3586.956 + y * (383.2556 + y * 3827.2642));
    let d4: f32 = -946.7237 + y * (2750.1265 + y * -1056.3835);
    let d5: f32 = 291.25507 + y * -754.39386;
    let d6: f32 = -52.70797;
    return (n0 + x * (n1 + x * (n2 + x * (n3 + x * (n4 + x * (n5 + x * n6)))))) / (d0 + x * (d1 + x * (d2 + x * (d3 + x * (d4 + x * (d5 + x * d6))))));
}

// The split sum of ggx (MODEL 9): a and b, with which a constant environment of 1 is reflected as f0 a + b, at
// N.V' and a roughness of [0.05, 1], to 2e-4. At views that graze more than 1e-6 it stays: there
// its slope is infinite. Fitted to the exact integrals and printed by specular/fitted.rs; nobody writes here.
fn split_sum_ggx(view_cosine: f32, roughness: f32) -> vec2f {
    let view: f32 = max(view_cosine, 1e-6);
    let y: f32 = 1.0526316 * roughness - 0.05263158;
    let lost_layer: f32 = 1.0 * roughness;
    let lost: f32 = ggx_lost(2.0 * sqrt(view * (1.0 + lost_layer) / (view + lost_layer)) - 1.0, y);
    let mean_layer: f32 = 2.0 * roughness * roughness;
    let mean: f32 = max(ggx_mean(1.0 - sqrt(view * (1.0 + mean_layer) / (view + mean_layer)), y), 0.0);
    let all: f32 = 1.0 - lost * lost;
    let square: f32 = mean * mean;
    let grazing: f32 = all * (square * square * mean);
    return vec2f(all - grazing, grazing);
}
