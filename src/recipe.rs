//! Recipe: every knob of a bake with unit, range and default; presets draft, balanced, best.
