// JSON of the server as messages of proto/liquidblend/v1, with defaults filled in.
import {
  createRegistry,
  fromJson,
  type DescMessage,
  type JsonValue,
  type MessageShape,
} from '@bufbuild/protobuf';
import { file_google_rpc_error_details } from '../generated/google/rpc/error_details_pb.ts';
import { file_liquidblend_v1_liquidblend } from '../generated/liquidblend/v1/liquidblend_pb.ts';

const registry = createRegistry(file_liquidblend_v1_liquidblend, file_google_rpc_error_details);

/** Reads a message. Fields that are not known, as of a newer server, are left out. */
export function fromServer<T extends DescMessage>(schema: T, json: unknown): MessageShape<T> {
  return fromJson(schema, withoutUnknownTypes(json), { registry, ignoreUnknownFields: true });
}

function isKnown(value: JsonValue): boolean {
  if (typeof value !== 'object' || value === null || Array.isArray(value)) return true;
  const type = value['@type'];
  return typeof type !== 'string' || !!registry.getMessage(type.slice(type.lastIndexOf('/') + 1));
}

// Messages in Any of a type that is not known cannot be read: leaves them out of lists.
function withoutUnknownTypes(json: unknown): JsonValue {
  if (Array.isArray(json)) {
    return json.filter((item) => isKnown(item as JsonValue)).map(withoutUnknownTypes);
  }
  if (typeof json !== 'object' || json === null) return json as JsonValue;
  return Object.fromEntries(
    Object.entries(json).map(([name, value]) => [name, withoutUnknownTypes(value)]),
  );
}
