//! Sets of things that are joined pair by pair.

/// Things 0, 1, 2, ... in sets that can be joined (union-find, ways to the root halved as they are walked): n joins and
/// look-ups take hardly more than n steps.
///
/// ```
/// use deepsft_geometry::DisjointSets;
/// let mut sets = DisjointSets::new(4);
/// sets.join(3, 1);
/// assert_eq!((sets.first(3), sets.first(1), sets.first(2)), (1, 1, 2));
/// ```
#[derive(Clone, Debug, Default)]
pub struct DisjointSets {
    /// A smaller thing of the same set; the set's first has itself.
    parent: Vec<usize>,
}

impl DisjointSets {
    /// `count` things, each a set of its own.
    pub fn new(count: usize) -> Self {
        Self {
            parent: (0..count).collect(),
        }
    }

    /// Adds a thing, a set of its own; gives its number.
    pub fn add(&mut self) -> usize {
        self.parent.push(self.parent.len());
        self.parent.len() - 1
    }

    /// The first (smallest) thing of the set that `thing` is in: equal for things of one set.
    ///
    /// # Panics
    /// When there is no such thing.
    pub fn first(&mut self, mut thing: usize) -> usize {
        while self.parent[thing] != thing {
            self.parent[thing] = self.parent[self.parent[thing]];
            thing = self.parent[thing];
        }
        thing
    }

    /// Numbers the sets in the order of their first things: the number of each thing's set, and how many sets there are.
    pub(crate) fn numbered(&mut self) -> (Vec<usize>, usize) {
        let (mut numbers, mut count) = (Vec::with_capacity(self.parent.len()), 0);
        for thing in 0..self.parent.len() {
            let first = self.first(thing);
            numbers.push(if first == thing { count } else { numbers[first] });
            count += usize::from(first == thing);
        }
        (numbers, count)
    }

    /// Makes the sets of `a` and `b` one.
    ///
    /// # Panics
    /// When there are no such things.
    pub fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.first(a), self.first(b));
        self.parent[a.max(b)] = a.min(b);
    }
}
