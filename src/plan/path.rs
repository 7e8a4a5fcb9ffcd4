//! The frames of a camera's path.

use glam::Vec3;

use super::spec::{Key, Spec};
use crate::runtime::View;

/// Height of a walker's eye, metres.
const EYE_M: f32 = 1.7;

/// One view a frame.
pub fn frames(spec: &Spec) -> Vec<View> {
    let reach = spec.region_m as f32 / 2.0;
    let walk = [
        key([-reach, EYE_M, 0.0], [0.0, EYE_M, 0.0]),
        key([reach, EYE_M, 0.0], [2.0 * reach, EYE_M, 0.0]),
    ];
    let keys = match spec.camera.as_slice() {
        [] => &walk[..],
        keys => keys,
    };
    (0..spec.frames)
        .map(|frame| {
            let (eye, target) = at(keys, frame, spec.frames);
            View::looking(
                eye,
                target - eye,
                spec.scene.fov_deg.to_radians() as f32,
                spec.scene.aspect as f32,
            )
        })
        .collect()
}

fn key(eye: [f32; 3], target: [f32; 3]) -> Key {
    Key { eye, target }
}

/// Eye and target of a frame, between the keys around it.
fn at(keys: &[Key], frame: u32, frames: u32) -> (Vec3, Vec3) {
    let last = keys.len() - 1;
    let along = f64::from(frame) / f64::from(frames.max(2) - 1) * last as f64;
    let from = (along as usize).min(last);
    let to = (from + 1).min(last);
    let part = (along - from as f64) as f32;
    let mix = |a: [f32; 3], b: [f32; 3]| Vec3::from(a).lerp(Vec3::from(b), part);
    (
        mix(keys[from].eye, keys[to].eye),
        mix(keys[from].target, keys[to].target),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_lie_evenly_between_keys() {
        let spec = Spec {
            camera: vec![
                key([0.0; 3], [0.0, 0.0, -5.0]),
                key([10.0, 0.0, 0.0], [10.0, 0.0, -5.0]),
                key([10.0, 4.0, 0.0], [10.0, 4.0, 5.0]),
            ],
            frames: 5,
            ..Spec::default()
        };
        let eyes: Vec<Vec3> = frames(&spec).iter().map(|v| v.eye).collect();
        let wanted = [
            [0.0, 0.0],
            [5.0, 0.0],
            [10.0, 0.0],
            [10.0, 2.0],
            [10.0, 4.0],
        ];
        for (eye, [x, y]) in eyes.iter().zip(wanted) {
            assert!(eye.distance(Vec3::new(x, y, 0.0)) < 1e-5, "{eyes:?}");
        }
        assert_eq!(frames(&spec)[0].forward, Vec3::NEG_Z);
    }

    #[test]
    fn one_frame_stands_at_the_first_key_and_without_keys_one_walks() {
        let spec = Spec {
            frames: 1,
            ..Spec::default()
        };
        assert_eq!(frames(&spec)[0].eye, Vec3::new(-150.0, 1.7, 0.0));
        assert_eq!(frames(&spec)[0].forward, Vec3::X);
        let all = frames(&Spec::default());
        assert_eq!(all.len(), 120);
        assert_eq!(all[119].eye, Vec3::new(150.0, 1.7, 0.0));
    }
}
