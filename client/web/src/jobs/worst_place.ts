// The viewer at the place and time where a registration is worst.
import { Vector3 } from 'three';
import type { Family, RegistrationReport } from '../generated/liquidblend/v1/liquidblend_pb.ts';
import { rounded } from '../scene/orbit.ts';
import { sceneRotation } from '../scene/up.ts';
import { initialState, toFields } from '../view/state.ts';

const share = 0.55;  // of the scene's diagonal: how near the camera goes

function sizeOf({ bounds }: Family): number {
  const { min, max } = bounds ?? {};
  if (!min || !max) return 1;
  return Math.hypot(max.x - min.x, max.y - min.y, max.z - min.z);
}

/** Fields of the URL: half-way to the target, beside the source and the target, all held there. */
export function worstPlace(
  family: Family,
  report: RegistrationReport,
): URLSearchParams | undefined {
  const worst = report.verdict?.worst;
  const at = worst?.position;
  if (!worst || !at) return undefined;
  const target = family.targets.indexOf(report.target);
  const place = new Vector3(at.x, at.y, at.z).applyMatrix4(sceneRotation(family.up));
  const orbit = rounded({
    azimuth: 24,
    elevation: 24,
    distance: share * sizeOf(family),
    target: [place.x, place.y, place.z],
  });
  return toFields({
    ...initialState(),
    name: family.name,
    weights: family.targets.map((_, index) => (index === target ? 0.5 : 0)),
    beside: ['source', `target.${target + 1}`],
    panes: [{ timeS: Math.round(worst.timeS * 1e4) / 1e4, orbit }],
  });
}
