use super::{Leaf, ViewBeamTree};
use crate::tree::MAX_DEPTH;

impl ViewBeamTree {
    /// Calls `visit(leaf, part)` for the leaves that what is looked for reaches, in their order, with the part of it that does.
    ///
    /// `divide(part, axis, plane)` tells what of a part reaches the left and the right side of a plane; none where nothing does.
    #[inline]
    pub(super) fn descend<P: Copy + Default>(
        &self,
        whole: P,
        divide: impl Fn(P, usize, f32) -> [Option<P>; 2],
        mut visit: impl FnMut(&Leaf, P),
    ) {
        let mut postponed = [(0_u32, P::default()); MAX_DEPTH];
        let mut waiting = 0;
        let (mut current, mut part) = (0, whole);
        loop {
            let node = self.nodes[current];
            if node.is_leaf() {
                visit(&self.leaves[node.target()], part);
            } else {
                let (left, right) = (current + 1, node.target());
                match divide(part, node.axis(), node.plane) {
                    [Some(on_left), on_right] => {
                        if let Some(on_right) = on_right {
                            postponed[waiting] = (right as u32, on_right);
                            waiting += 1;
                        }
                        (current, part) = (left, on_left);
                        continue;
                    }
                    [None, Some(on_right)] => {
                        (current, part) = (right, on_right);
                        continue;
                    }
                    [None, None] => {}
                }
            }
            if waiting == 0 {
                return;
            }
            waiting -= 1;
            let (next, those) = postponed[waiting];
            (current, part) = (next as usize, those);
        }
    }
}
