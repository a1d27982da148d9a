// A worker that decodes frames. It answers each job with the job's buffers, filled.
import { transferables } from './buffers.ts';
import type { DecodeJob, Decoded, SetUp } from './decode_messages.ts';
import { createDraco, type DracoReader } from './draco.ts';

let reader: Promise<DracoReader> | undefined;

async function decode({ id, data, wanted, buffers }: DecodeJob): Promise<Decoded> {
  const draco = await reader!;
  const begin = performance.now();
  try {
    const counts = draco.read(data, wanted, buffers);
    return { id, buffers, counts, decodeMs: performance.now() - begin };
  } catch (error) {
    return { id, buffers, error: String(error), decodeMs: performance.now() - begin };
  }
}

self.onmessage = async ({ data }: MessageEvent<SetUp | DecodeJob>) => {
  if (data.kind === 'setUp') {
    reader = createDraco(data.module);
    return;
  }
  const decoded = await decode(data);
  self.postMessage(decoded, { transfer: transferables(decoded.buffers) });
};
