import assert from 'node:assert/strict';
import { test } from 'node:test';
import { errorFromJson, toApiError } from '../src/api/errors.ts';
import { withQuery } from '../src/api/http.ts';
import { fromServer } from '../src/api/messages.ts';
import { base64Url, subprotocols } from '../src/api/token.ts';
import { FamilySchema } from '../src/generated/liquidblend/v1/liquidblend_pb.ts';

const status = {
  code: 3,
  message: 'weights: must be in [-1, 2]',
  details: [
    {
      '@type': 'type.googleapis.com/google.rpc.BadRequest',
      fieldViolations: [{ field: 'weights', description: 'must be in [-1, 2], got 5' }],
    },
    {
      '@type': 'type.googleapis.com/google.rpc.ErrorInfo',
      reason: 'OUTSIDE_HULL',
      metadata: { distance: '0.3' },
    },
    { '@type': 'type.googleapis.com/google.rpc.RetryInfo', retryDelay: '1.5s' },
    { '@type': 'type.googleapis.com/google.rpc.RequestInfo', requestId: 'abc' },
    { '@type': 'type.googleapis.com/somebody.Else', text: 'ignored' },
  ],
};

test('ErrorsKeepMessageAndDetails', () => {
  const error = errorFromJson(400, status);
  assert.equal(error.message, status.message);
  assert.equal(error.reason, 'OUTSIDE_HULL');
  assert.equal(error.retryAfterS, 1.5);
  assert.deepEqual(error.details, [
    { label: 'weights', text: 'must be in [-1, 2], got 5' },
    { label: 'reason', text: 'OUTSIDE_HULL' },
    { label: 'distance', text: '0.3' },
    { label: 'retry after', text: '1.5s' },
    { label: 'request', text: 'abc' },
  ]);
});

test('ErrorsThatAreNoStatusHaveTheirNumber', () => {
  for (const json of [undefined, null, 'text', [], { details: [] }, { message: 5 }]) {
    assert.match(errorFromJson(502, json).message, /status 502/);
  }
  assert.ok(errorFromJson(401, undefined).needsToken);
});

test('ErrorsWithOddDetailsAreRead', () => {
  const details = [
    5,
    null,
    { '@type': 7 },
    { '@type': 'x/google.rpc.BadRequest', fieldViolations: 'no' },
  ];
  assert.deepEqual(errorFromJson(400, { message: 'bad', details }).details, []);
});

test('LostConnectionsAreErrorsWithoutStatus', () => {
  assert.equal(toApiError(new TypeError('Failed to fetch')).status, 0);
});

test('TokensBecomeSubprotocolsWithoutPadding', () => {
  assert.deepEqual(subprotocols(''), []);
  assert.deepEqual(subprotocols('a?>~é'), [
    'liquidblend.v1',
    `liquidblend.bearer.${base64Url('a?>~é')}`,
  ]);
  assert.match(base64Url('a?>~é'), /^[A-Za-z0-9_-]+$/);
  assert.equal(Buffer.from(base64Url('a?>~é'), 'base64url').toString(), 'a?>~é');
});

test('QueriesLeaveOutWhatIsNotSet', () => {
  assert.equal(withQuery('/x', { a: undefined, b: '' }), '/x');
  assert.equal(withQuery('/x', { a: 0, b: 'c d' }), '/x?a=0&b=c+d');
});

test('FamiliesOfNewerServersAreRead', () => {
  const json = {
    name: 'families/f',
    version: '3',
    up: 'UP_Y',
    newField: { x: 1 },
    failedRegistration: {
      operation: 'operations/1',
      error: {
        code: 9,
        message: 'no',
        details: [{ '@type': 'type.googleapis.com/new.Type', x: 1 }],
      },
    },
  };
  const family = fromServer(FamilySchema, json);
  assert.equal(family.version, 3n);
  assert.equal(family.failedRegistration?.error?.message, 'no');
  assert.deepEqual(family.targets, []);
});
