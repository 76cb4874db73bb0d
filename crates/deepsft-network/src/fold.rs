//! Folding: what only training needs is baked into the weights.

/// A layer, or layers, that can be folded.
pub(super) trait Fold {
    /// The same function for inference, with weight standardisation and batch normalisation baked into filters and biases.
    fn fold(self) -> Self;
}

impl<T: Fold> Fold for Option<T> {
    fn fold(self) -> Self {
        self.map(T::fold)
    }
}

impl<T: Fold> Fold for Vec<T> {
    fn fold(self) -> Self {
        self.into_iter().map(T::fold).collect()
    }
}

impl<T: Fold, const N: usize> Fold for [T; N] {
    fn fold(self) -> Self {
        self.map(T::fold)
    }
}

/// `$layers` with the first fields folded and the others as they are.
macro_rules! folded {
    ($layers:expr, [$($folded:ident),+], [$($kept:ident),*]) => {
        Self {
            $($folded: $layers.$folded.fold(),)+
            $($kept: $layers.$kept,)*
        }
    };
}

pub(super) use folded;
