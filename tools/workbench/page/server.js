// SPDX-License-Identifier: Apache-2.0
// Requests to the server. It answers with JSON, or with bytes for pixels.

export class Refused extends Error {
  constructor(text, status) {
    super(text);
    this.status = status;  // 409: another tab or program changed it
  }
}

const address = (path, parameters) =>
    path + (parameters ? '?' + new URLSearchParams(Object.entries(parameters).map(([k, v]) => [k, String(v)])) : '');

async function checked(reply) {
  if (reply.ok) return reply;
  let text = 'the server answered ' + reply.status;
  try {
    text = (await reply.json()).error || text;
  } catch (error) { /* the answer is no JSON: the number stays */
  }
  throw new Refused(text, reply.status);
}

async function fetched(path, options) {
  try {
    return await checked(await fetch(path, options));
  } catch (error) {
    if (error instanceof Refused || error.name === 'AbortError') throw error;
    throw new Refused('marrow does not answer. If it has ended, start it again with: marrow open', 0);
  }
}

const posted = (path, body, signal) => fetched(path, {
  method: 'POST',
  headers: {'Content-Type': 'application/json', 'X-Marrow': '1'},
  body: JSON.stringify(body || {}),
  signal
});
const get = (path, parameters, signal) => fetched(address(path, parameters), {signal});
const bytesOf = async (reply) =>
    ({bytes: await reply.arrayBuffer(), about: JSON.parse(reply.headers.get('X-Marrow-About') || 'null')});

// Follows a job until it ends. told(event) gets each of its events. Resolves to its result.
export async function follow(job, told) {
  for (let since = 0;;) {
    const state = await (await get('api/job', {job, since})).json();
    since = state.next;
    for (const event of state.events) told && told(event);
    if (state.state === 'done') return state.result;
    if (state.state === 'stopped') throw new Refused('stopped', 499);
    if (state.state === 'failed') throw new Refused(state.error, 400);
  }
}

export const json = async (path, parameters, signal) => (await get(path, parameters, signal)).json();
export const bytes = async (path, parameters, signal) => bytesOf(await get(path, parameters, signal));
export const post = async (path, body, signal) => (await posted(path, body, signal)).json();
export const postForBytes = async (path, body, signal) => bytesOf(await posted(path, body, signal));

// Returns a function that posts the newest body to `path` when no other has come for some time, if there is enough to
// ask about. answered(answer, fault) gets (null, '') where there is not.
export function whenStill(path, pause_ms, answered) {
  let known = '', timer = null, aborter = new AbortController();
  async function ask(body) {
    aborter = new AbortController();
    try {
      answered(await post(path, body, aborter.signal), '');
    } catch (error) {
      if (error.name !== 'AbortError') answered(null, error.message);
    }
  }
  return (body, is_enough) => {
    const text = JSON.stringify(body);
    if (text === known) return;
    known = text;
    clearTimeout(timer);
    aborter.abort();
    if (is_enough)
      timer = setTimeout(() => ask(body), pause_ms);
    else
      answered(null, '');
  };
}

export const stop = (job) => posted('api/job/stop', {job});
