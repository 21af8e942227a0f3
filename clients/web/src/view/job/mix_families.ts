import type { Job } from 'tessera-render';
import { filmOf } from '../../api/states';
import { isPart } from './view_modes';

/** Shares of one family are disjoint; each complete family adds up to the image. */
export interface Family {
  label: string;
  layers: string[];
  /** lightGroups: all groups of the scene. */
  isComplete: (lightGroups: readonly string[]) => boolean;
}

const range = (from: number, to: number): number[] =>
  Array.from({ length: Math.max(0, to - from + 1) }, (_, i) => from + i);

function hasAllBounces(names: string[], mostBounces: number): boolean {
  const open = names.find((name) => name.endsWith('-'));
  const end = open ? parseInt(open, 10) - 1 : mostBounces;
  return range(0, end).every((n) => names.includes(String(n)));
}

/** Every s and t of paths that the job traces; light that hits the camera itself is not seen. */
function hasAllStrategies(names: string[], mostBounces: number): boolean {
  const kept = new Set(names);
  return range(2, mostBounces + 2).every((vertices) =>
    range(vertices === 2 ? 2 : 1, vertices).every((t) => kept.has(`${vertices - t},${t}`)),
  );
}

/** The families of which a job records parts of the image, in the order of preference. */
export function familiesOf(job: Job): Family[] {
  const parts = filmOf(job).layers.filter(isPart);
  const most = job.spec.integrator.max_depth;
  const family = (
    label: string,
    prefix: string,
    isComplete: (names: string[], lightGroups: readonly string[]) => boolean,
  ): Family => {
    const layers = parts.filter((layer) => layer.startsWith(prefix));
    const names = layers.map((layer) => layer.slice(prefix.length));
    return { label, layers, isComplete: (groups) => isComplete(names, groups) };
  };
  return [
    family('Bounces', 'bounce:', (names) => hasAllBounces(names, most)),
    family('Lights', 'light:', (names, groups) => groups.every((group) => names.includes(group))),
    family('Strategies', 'st:', (names) => hasAllStrategies(names, most)),
  ].filter(({ layers }) => layers.length > 0);
}

/** The family that is shown at first: the first complete one, or else the first. */
export const firstFamily = (
  families: Family[],
  lightGroups: readonly string[],
): Family | undefined => families.find((family) => family.isComplete(lightGroups)) ?? families[0];
