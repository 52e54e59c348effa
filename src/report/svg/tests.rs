#[test]
fn parametrizations_differ_in_colour_for_every_eye() {
    /// What the colour-blind see of linear R, G, B (Machado, Oliveira and Fernandes 2009): all, no
    /// green, no red, no blue.
    const EYES: [[[f64; 3]; 3]; 4] = [
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        [
            [0.367_322, 0.860_646, -0.227_968],
            [0.280_085, 0.672_501, 0.047_413],
            [-0.011_820, 0.042_940, 0.968_881],
        ],
        [
            [0.152_286, 1.052_583, -0.204_868],
            [0.114_503, 0.786_281, 0.099_216],
            [-0.003_882, -0.048_116, 1.051_998],
        ],
        [
            [1.255_528, -0.076_749, -0.178_779],
            [-0.078_411, 0.930_809, 0.147_602],
            [0.004_733, 0.691_367, 0.303_900],
        ],
    ];
    let dot = |row: &[f64; 3], c: [f64; 3]| row.iter().zip(c).map(|(a, b)| a * b).sum::<f64>();
    let lab = |eye: &[[f64; 3]; 3], color: [u8; 3]| {
        let linear = color.map(|v| (f64::from(v) / 255.0).powf(2.2));
        let [r, g, b] = [0, 1, 2].map(|i| dot(&eye[i], linear).clamp(0.0, 1.0));
        let x = dot(&[0.4339, 0.3762, 0.1899], [r, g, b]);
        let y = dot(&[0.2126, 0.7152, 0.0722], [r, g, b]);
        let z = dot(&[0.0177, 0.1095, 0.8728], [r, g, b]);
        let [x, y, z] = [x, y, z].map(f64::cbrt);
        [116.0 * y, 500.0 * (x - y), 200.0 * (y - z)]
    };
    let all = crate::parametrization::all();
    let colors: Vec<[u8; 3]> = all
        .iter()
        .map(|e| super::palette(super::plot::color_of(e.kind), 0))
        .collect();
    for eye in &EYES {
        for (i, a) in colors.iter().enumerate() {
            for b in &colors[..i] {
                let [p, q] = [a, b].map(|c| lab(eye, *c));
                let far = p.iter().zip(q).map(|(p, q)| (p - q).powi(2)).sum::<f64>();
                // A just noticeable difference is about 2.
                assert!(far.sqrt() > 12.0, "{a:?} {b:?} {far}");
            }
        }
    }
}
