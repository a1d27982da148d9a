// What the registration form says, as a RegisterFamilyRequest in JSON.
import type { Json } from '../api/changes.ts';
import { idRule, isId } from '../api/names.ts';
import {
  CorrespondenceSchema,
  type Correspondence,
  type Family,
} from '../generated/liquidblend/v1/liquidblend_pb.ts';
import { toJson, type JsonValue } from '@bufbuild/protobuf';

export interface Member {
  animation: string;  // animations/{id}; the first one is the source
  values: string[];  // its point, as typed
}

export interface RegisterForm {
  family: string;
  members: Member[];
  parameters: string[];  // none: frames are asked for by weights only
  interpolation: 'LINEAR' | 'SMOOTH';
  iterations: string;
  automatic: boolean;
  timeBlending: 'AUTOMATIC' | 'LINEAR' | 'SQUARES';
  restTime: string;
  requiredGrade: '' | 'GOOD' | 'DOUBTFUL';
  replace: boolean;
}

export function emptyForm(): RegisterForm {
  return {
    family: '',
    members: [
      { animation: '', values: [] },
      { animation: '', values: [] },
    ],
    parameters: [],
    interpolation: 'LINEAR',
    iterations: '',
    automatic: true,
    timeBlending: 'AUTOMATIC',
    restTime: '',
    requiredGrade: '',
    replace: false,
  };
}

const parameterPattern = /^[a-z][a-z0-9_]{0,62}$/;

function faultOfParameters({ parameters, members }: RegisterForm): string {
  if (new Set(parameters).size < parameters.length) return 'Two parameters have the same name.';
  for (const name of parameters) {
    if (!parameterPattern.test(name)) {
      return `"${name}" is no name of a parameter: a-z, 0-9 and "_", the first one a letter.`;
    }
  }
  const lacks = members.some(({ values }) =>
    parameters.some((_, i) => !(values[i] ?? '').trim() || !Number.isFinite(Number(values[i]))),
  );
  return parameters.length && lacks ? 'Every animation needs a number for each parameter.' : '';
}

/** Why it cannot be sent; empty if it can. The server checks the rest. */
export function faultOf(form: RegisterForm): string {
  if (!isId(form.family)) return `The family's name may have ${idRule}.`;
  const names = form.members.map(({ animation }) => animation);
  if (names.some((name) => !name)) return 'Choose an animation for the source and for each target.';
  if (new Set(names).size < names.length) return 'An animation is there twice.';
  return faultOfParameters(form);
}

function optionsOf({ iterations, automatic }: RegisterForm): Json {
  return {
    ...(Number(iterations) > 0 ? { maxIterations: Number(iterations) } : {}),
    ...(automatic ? {} : { automaticCorrespondences: false }),
  };
}

function spaceOf({ parameters, members, interpolation }: RegisterForm): Json {
  if (!parameters.length) return {};
  const points = members.map(({ values }) => ({
    values: parameters.map((_, i) => Number(values[i])),
  }));
  return { parameterSpace: { names: parameters, points, interpolation } };
}

function blendingOf({ timeBlending, restTime }: RegisterForm): Json {
  if (timeBlending === 'AUTOMATIC') return {};
  const restTimeS = timeBlending === 'SQUARES' && Number(restTime) ? Number(restTime) : 0;
  return { timeBlending: { kind: timeBlending, ...(restTimeS ? { restTimeS } : {}) } };
}

export function requestOf(form: RegisterForm): Json {
  const [source, ...targets] = form.members.map(({ animation }) => animation);
  return {
    familyId: form.family,
    source,
    targets,
    options: optionsOf(form),
    ...spaceOf(form),
    ...blendingOf(form),
    ...(form.requiredGrade ? { requiredGrade: form.requiredGrade } : {}),
    ...(form.replace ? { replace: true } : {}),
  };
}

export function correspondencesJson(correspondences: Correspondence[]): JsonValue {
  return { correspondences: correspondences.map((pair) => toJson(CorrespondenceSchema, pair)) };
}

/** Goes on from a family's newest version with the same pairs of the user. */
export function refineRequest(family: Family, iterations: number): Json {
  const own = family.reports.map(({ correspondences }) =>
    correspondences
      .filter(({ automatic }) => !automatic)
      .map(({ correspondence }) => correspondence!),
  );
  return {
    familyId: family.name,
    refine: true,
    options: iterations > 0 ? { maxIterations: iterations } : {},
    ...(own.some((list) => list.length) ? { correspondences: own.map(correspondencesJson) } : {}),
  };
}
