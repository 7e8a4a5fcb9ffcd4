//! Everything that is seen from one view: the original, drawn once at each size and kept while all
//! levels pass by.

use super::asked::Asked;
use super::outline::Outline;
use super::schema::ViewAppearance;
use super::shot::Shot;
use super::silhouette::moved_f1;
use super::stage::{Actor, Order, Window, sampling};
use crate::space::raster::{Camera, Mask, Sampling, Tone};
use crate::space::view::View;

/// Samples along a pixel's edge where an engine has few: of edges, and of alpha.
pub const FEW_SIDES: [u32; 2] = [2, 1];

/// Angle between two frames of an orbit, degrees.
pub const STEP_DEG: f32 = 1.0;

/// What one view gives for one model.
#[derive(Default)]
pub struct OfView {
    /// By height, in the order asked for.
    pub sizes: Vec<OfSize>,
    /// To the next level.
    pub jump: Option<Leap>,
    /// From frame to frame: the model's change and the original's.
    pub orbit: Option<[ViewAppearance; 2]>,
}

/// What one view gives for one model at one size.
pub struct OfSize {
    /// Height of the tree in pixels.
    pub height_px: u32,
    /// Supersampled, beside the original.
    pub outline: Option<Outline>,
    /// F1 of the original moved by half a pixel.
    pub moved_f1: f64,
    /// As an engine draws it.
    pub client: Option<Outline>,
    /// [`Actor::base_color`].
    pub base_color: Option<Tone>,
    /// With few samples and no mips, as many along a pixel's edge as [`FEW_SIDES`] says.
    pub few_samples: Option<[Outline; 2]>,
    /// How it looks beside the original.
    pub look: Option<ViewAppearance>,
}

/// One view of a jump.
pub struct Leap {
    /// The silhouettes.
    pub outline: Outline,
    /// How both look.
    pub look: ViewAppearance,
}

/// Everything seen from one view.
pub struct Stand<'a> {
    asked: &'a Asked<'a>,
    actors: &'a [Actor<'a>],
    view: &'a View,
    /// The view a frame later, for views that orbits are measured from.
    next: Option<View>,
    /// For each actor its triangles as this view draws them, where colours are.
    orders: Vec<Order>,
    /// The tree's height in its normalised space.
    height: f32,
}

/// A picture of the original or of a level.
struct Drawn {
    mask: Option<Mask>,
    /// Covered share of every pixel; empty where `shot` has it.
    coverage: Vec<f32>,
    shot: Option<Shot>,
}

impl Drawn {
    fn coverage(&self) -> &[f32] {
        self.shot
            .as_ref()
            .map_or(&self.coverage, |shot| &shot.layers.coverage)
    }
}

impl<'a> Stand<'a> {
    /// Of the original, so high in its normalised space, and all levels (`actors`, in that order).
    pub fn new(asked: &'a Asked, actors: &'a [Actor], (view, height): (&'a View, f32)) -> Self {
        let next = (view.elevation_deg == 0.0).then(|| View {
            azimuth_deg: view.azimuth_deg + STEP_DEG,
            ..view.clone()
        });
        let forward = -view.towards_eye();
        let orders = actors.iter().map(|a| a.front_to_back(forward));
        Self {
            asked,
            actors,
            view,
            next,
            orders: match asked.looks {
                true => orders.collect(),
                false => Vec::new(),
            },
            height,
        }
    }

    /// For each actor what it shows at these heights of the tree in pixels.
    pub fn measure(&self, heights_px: &[u32]) -> Vec<OfView> {
        let mut out: Vec<OfView> = self.actors.iter().map(|_| OfView::default()).collect();
        for &height_px in heights_px {
            self.at(height_px, &mut out);
        }
        out
    }

    fn at(&self, height_px: u32, out: &mut [OfView]) {
        let asked = self.asked;
        let starts = |level: usize| asked.starts_px.get(level) == Some(&height_px);
        // A frame later matters where a level is shown from here on.
        let turns = (0..asked.levels.len()).any(starts);
        let next = self.next.as_ref().filter(|_| turns);
        let cameras: Vec<Camera> = [self.view]
            .into_iter()
            .chain(next)
            .map(|view| view.camera_through(asked.lens, self.height, height_px))
            .collect();
        let window = Window::around(self.actors, &cameras);
        let camera = window.on(cameras[0]);
        let next = cameras.get(1).map(|&camera| window.on(camera));
        let original = self.drawn(0, &camera, height_px, true);
        let original_next = next.map(|camera| self.shot(0, &camera, height_px));
        self.add_original(&original, &camera, height_px, &mut out[0]);
        // The level before, where the present one takes over.
        let mut before: Option<Drawn> = None;
        for level in 0..asked.levels.len() {
            let is_asked = asked.heights_px[level].contains(&height_px);
            if !(is_asked || starts(level) || starts(level + 1)) {
                before = None;
                continue;
            }
            let drawn = self.drawn(level + 1, &camera, height_px, false);
            if is_asked {
                let found = self.beside(&original, &drawn, level + 1, &camera, height_px);
                out[level + 1].sizes.push(found);
            }
            if starts(level) {
                out[level + 1].orbit = next.as_ref().and_then(|camera| {
                    let [now, then] = [
                        drawn.shot.as_ref()?,
                        &self.shot(level + 1, camera, height_px),
                    ];
                    let of_original = [original.shot.as_ref()?, original_next.as_ref()?];
                    let change = |[now, then]: [&Shot; 2]| self.compare(now, then);
                    Some([change([now, then]), change(of_original)])
                });
                let leap = before.as_ref().and_then(|b| self.leap(b, &drawn));
                if level > 0 {
                    out[level].jump = leap;
                }
            }
            before = Some(drawn);
        }
    }

    fn add_original(&self, drawn: &Drawn, camera: &Camera, height_px: u32, out: &mut OfView) {
        let mask = drawn.mask.as_ref();
        let moved_f1 = mask.map_or(1.0, |mask| moved_f1(mask, drawn.coverage()));
        let wanted = self.asked.original_px.contains(&height_px);
        let name = &self.view.name;
        let itself = || Outline::new(name, drawn.coverage(), drawn.coverage());
        out.sizes.push(OfSize {
            height_px,
            outline: wanted.then(itself),
            moved_f1,
            client: if wanted {
                self.client(drawn, 0, camera)
            } else {
                None
            },
            base_color: if wanted {
                self.base_color(0, camera)
            } else {
                None
            },
            few_samples: None,
            look: None,
        });
    }

    fn beside(
        &self,
        original: &Drawn,
        drawn: &Drawn,
        actor: usize,
        camera: &Camera,
        height_px: u32,
    ) -> OfSize {
        let name = &self.view.name;
        let both = original.shot.as_ref().zip(drawn.shot.as_ref());
        OfSize {
            height_px,
            outline: Some(Outline::new(name, original.coverage(), drawn.coverage())),
            moved_f1: 0.0,
            client: self.client(original, actor, camera),
            base_color: self.base_color(actor, camera),
            few_samples: self.few_samples(original, actor, camera),
            look: both.map(|(a, b)| self.compare(a, b)),
        }
    }

    fn client(&self, original: &Drawn, actor: usize, camera: &Camera) -> Option<Outline> {
        self.asked.client.then(|| {
            let drawn = self.actors[actor].client(camera);
            Outline::new(&self.view.name, original.coverage(), &drawn.fraction)
        })
    }

    fn few_samples(&self, original: &Drawn, actor: usize, camera: &Camera) -> Option<[Outline; 2]> {
        let drawn = |side| {
            let sampling = Sampling {
                side,
                ..Sampling::REFERENCE
            };
            let mask = self.actors[actor].mask(camera, sampling);
            let fraction = mask.coverage().fraction;
            Outline::new(&self.view.name, original.coverage(), &fraction)
        };
        self.asked.causes.then(|| FEW_SIDES.map(drawn))
    }

    fn base_color(&self, actor: usize, camera: &Camera) -> Option<Tone> {
        let asked = self.asked.causes;
        asked.then(|| self.actors[actor].base_color(camera))
    }

    /// Draws an actor; where `keep` is set, the samples stay.
    fn drawn(&self, actor: usize, camera: &Camera, height_px: u32, keep: bool) -> Drawn {
        let sampling = sampling(height_px);
        if !self.asked.looks {
            let mask = self.actors[actor].mask(camera, sampling);
            return Drawn {
                coverage: mask.coverage().fraction,
                mask: keep.then_some(mask),
                shot: None,
            };
        }
        let order = &self.orders[actor];
        let (mask, layers) = self.actors[actor].layers(camera, sampling, order);
        Drawn {
            mask: keep.then_some(mask),
            coverage: Vec::new(),
            shot: Some(Shot::new(layers)),
        }
    }

    fn shot(&self, actor: usize, camera: &Camera, height_px: u32) -> Shot {
        let order = &self.orders[actor];
        Shot::new(
            self.actors[actor]
                .layers(camera, sampling(height_px), order)
                .1,
        )
    }

    fn compare(&self, before: &Shot, after: &Shot) -> ViewAppearance {
        before.compare(after, &self.view.name, self.height.into())
    }

    fn leap(&self, before: &Drawn, after: &Drawn) -> Option<Leap> {
        let look = self.compare(before.shot.as_ref()?, after.shot.as_ref()?);
        Some(Leap {
            outline: Outline::new(&self.view.name, before.coverage(), after.coverage()),
            look,
        })
    }
}
