//! What a sweep tries: every preset, and each knob of accuracy alone.

use crate::recipe::{Method, Preset, Recipe};

/// A recipe with a name.
#[derive(Clone, Debug, PartialEq)]
pub struct Variant {
    /// "draft", "samples 2".
    pub name: String,
    /// The recipe.
    pub recipe: Recipe,
}

/// The name of the recipe that all others are compared with.
pub const BASE: &str = "balanced";

/// The names of the presets; all other variants change one knob of the base.
pub const PRESETS: [&str; 3] = [BASE, "draft", "best"];

/// Presets, then each knob of the balanced preset with its other values.
pub fn variants() -> Vec<Variant> {
    let preset = |name: &str, preset| Variant {
        name: name.into(),
        recipe: Recipe::preset(preset),
    };
    let mut out = vec![
        preset(BASE, Preset::Balanced),
        preset("draft", Preset::Draft),
        preset("best", Preset::Best),
    ];
    let mut alone = |name: String, change: &dyn Fn(&mut Recipe)| {
        let mut recipe = Recipe::balanced();
        change(&mut recipe);
        if recipe != Recipe::balanced() {
            out.push(Variant { name, recipe });
        }
    };
    for n in [1, 2, 3, 4, 6] {
        alone(format!("samples {n}"), &|r| r.samples = n);
    }
    for n in [0, 2, 3, 6, 12] {
        alone(format!("refine_rounds {n}"), &|r| r.refine_rounds = n);
    }
    for n in [8, 12, 48] {
        alone(format!("training_views {n}"), &|r| r.training_views = n);
    }
    for n in [0, 4, 30] {
        alone(format!("reassign_rounds {n}"), &|r| r.reassign_rounds = n);
    }
    for n in [0.5, 2.0] {
        alone(format!("texel_density {n}"), &|r| r.texel_density = n);
    }
    for n in [0.001, 0.1] {
        alone(format!("locality {n}"), &|r| r.locality = n);
    }
    for n in [1, 2] {
        alone(format!("light_map_halvings {n}"), &|r| {
            r.light_map_halvings = Some(n);
        });
    }
    for n in [0.01, 0.02] {
        alone(format!("sharing {n}"), &|r| r.sharing = n);
    }
    alone("gutter_texels 4".into(), &|r| r.gutter_texels = 4.0);
    alone("rectangular cards".into(), &|r| r.triangular_cards = false);
    // Kratt's loop, which then may choose crosses and strips, too, or planes alone.
    alone("adaptive loop".into(), &|r| r.method = Method::AdaptiveLoop);
    alone("adaptive loop of planes".into(), &|r| {
        r.method = Method::AdaptiveLoop;
        r.billboards = Vec::new();
    });
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::knobs::check;

    #[test]
    fn every_variant_is_valid_and_differs_from_all_others() {
        let all = variants();
        assert_eq!(all[0].recipe, Recipe::balanced());
        for (i, variant) in all.iter().enumerate() {
            check(&variant.recipe).unwrap();
            for other in &all[..i] {
                assert_ne!(variant.recipe, other.recipe, "{}", variant.name);
                assert_ne!(variant.name, other.name);
                assert!(!variant.name.contains(','), "`--only` splits there");
            }
        }
        assert!(all.len() > 15);
    }
}
