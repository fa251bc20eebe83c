// Sizes of a document under the pencil: what is being typed may be no number yet.

/** The number, or 0. */
export const finite = (value) => (Number.isFinite(value) ? value : 0);

/** The radii of a cylinder; without one of its own, its soft zone ends at its core. */
export function radiiOf({ radius, influence }) {
  const core = finite(radius);
  return { radius: core, influence: Number.isFinite(influence) ? influence : core };
}
