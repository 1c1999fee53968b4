"use strict";

/** Whether the program uses the engine for few balls, see ``engine_for`` of simulation.py. */
function usesAllPairs(scene) {
  const { container, containerMass, radii, slides } = scene;
  if (container.shape !== "circle") return false;
  if (slides) return true;
  const packing = packingFraction(container, pairwiseSum(radii.map((radius) => radius * radius)));
  const root = Math.sqrt(Math.sqrt(packing)), few = containerMass < Infinity ? 150 : 48;
  return radii.length <= Math.floor(Math.min(few / (root * Math.sqrt(root)), 1000));
}
