//! What of lines and areas lies inside a frame: no curve leaves its panel.

/// Ends of a frame along x and along y.
pub(super) type Frame = [[f64; 2]; 2];

/// The parts of a line inside a frame, without points too close to their neighbours to be
/// distinguished.
pub(super) fn clipped(points: &[[f64; 2]], frame: Frame) -> Vec<Vec<[f64; 2]>> {
    const APART: f64 = 0.1;
    let mut parts: Vec<Vec<[f64; 2]>> = Vec::new();
    let mut open = false;
    for ends in points.windows(2) {
        let (a, b) = (ends[0], ends[1]);
        let mut t = [0.0f64, 1.0f64];
        for i in 0..2 {
            let d = b[i] - a[i];
            for (edge, sign) in [(frame[i][0], 1.0), (frame[i][1], -1.0)] {
                // Inside where sign (a + t d − edge) ≥ 0.
                let (at, slope) = (sign * (a[i] - edge), sign * d);
                if slope == 0.0 {
                    // A line along the edge is off it by rounding.
                    if at < -1e-6 {
                        t = [1.0, 0.0];
                    }
                } else if slope > 0.0 {
                    t[0] = t[0].max(-at / slope);
                } else {
                    t[1] = t[1].min(-at / slope);
                }
            }
        }
        if !(t[0] <= t[1]) {
            open = false;
            continue;
        }
        let [from, to] = t.map(|t| [0, 1].map(|i| a[i] + t * (b[i] - a[i])));
        if !open || t[0] > 0.0 {
            parts.push(vec![from]);
        }
        if let Some(part) = parts.last_mut() {
            let last = part[part.len() - 1];
            // The first two stay, so that a short line is still one.
            if part.len() == 1 || (to[0] - last[0]).hypot(to[1] - last[1]) >= APART {
                part.push(to);
            }
        }
        open = t[1] >= 1.0;
    }
    parts
}

/// The part of a polygon inside a frame (Sutherland and Hodgman 1974); a concave one may keep sides of no width along
/// the frame.
pub(super) fn clipped_area(corners: &[[f64; 2]], frame: Frame) -> Vec<[f64; 2]> {
    let mut corners = corners.to_vec();
    for i in 0..2 {
        for (edge, sign) in [(frame[i][0], 1.0), (frame[i][1], -1.0)] {
            let inside = |p: [f64; 2]| sign * (p[i] - edge);
            let mut kept = Vec::with_capacity(corners.len() + 4);
            let mut last = corners.last().copied();
            for &next in &corners {
                if let Some(before) = last {
                    let [a, b] = [inside(before), inside(next)];
                    if (a < 0.0) != (b < 0.0) {
                        let t = a / (a - b);
                        let mut cut = [0, 1].map(|k| before[k] + t * (next[k] - before[k]));
                        cut[i] = edge;
                        kept.push(cut);
                    }
                    if b >= 0.0 {
                        kept.push(next);
                    }
                }
                last = Some(next);
            }
            corners = kept;
        }
    }
    corners
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: Frame = [[0.0, 4.0], [0.0, 2.0]];

    #[test]
    fn nothing_is_drawn_outside_of_a_frame() {
        let inside = |p: &[f64; 2]| (0..2).all(|i| (FRAME[i][0]..=FRAME[i][1]).contains(&p[i]));
        let zigzag: Vec<[f64; 2]> = (-3..9)
            .map(|i| [f64::from(i), f64::from(i * 7 % 5 - 1)])
            .collect();
        let area = clipped_area(&zigzag, FRAME);
        assert!(!area.is_empty() && area.iter().all(inside), "{area:?}");
        let lines = clipped(&zigzag, FRAME).concat();
        assert!(!lines.is_empty());
        // The ends of a line are rounded.
        for p in lines {
            assert!((0..2).all(|i| p[i] >= FRAME[i][0] - 1e-9 && p[i] <= FRAME[i][1] + 1e-9));
        }
        // A triangle whose tip is cut off is a trapezium.
        let cut = clipped_area(&[[0.0, 0.0], [4.0, 0.0], [2.0, 4.0]], FRAME);
        let next = cut.iter().cycle().skip(1);
        let twice = cut.iter().zip(next).map(|(a, b)| a[0] * b[1] - a[1] * b[0]);
        assert!((twice.sum::<f64>() - 12.0).abs() < 1e-12, "{cut:?}");
        assert!(clipped_area(&[[5.0, 0.0], [6.0, 0.0], [6.0, 1.0]], FRAME).is_empty());
    }
}
