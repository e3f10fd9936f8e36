/** The browser's client against a served drive, over TCP instead of a WebSocket. */

import assert from 'node:assert/strict';
import net from 'node:net';
import { test } from 'node:test';

import { Client, EDGES, RUN, RefusedError, WrongKeyError } from '../src/link/client.js';
import { DEVELOPMENT_KEY } from '../src/link/siphash.js';

function tcp(port) {
  const socket = new net.Socket();
  return {
    open: () => new Promise((resolve) => socket.connect(port, '127.0.0.1', resolve)),
    write: (bytes) => socket.write(bytes),
    onData: (take) => socket.on('data', take),
    onClose: (gone) => socket.on('close', gone),
    close: () => socket.destroy(),
  };
}

const port = Number(process.env.ZH_LINK_PORT);

async function connected(t) {
  const client = new Client(tcp(port));
  await client.open();
  t.after(() => client.close());
  await client.describe();
  return client;
}

async function until(what, holds) {
  for (let n = 0; n < 500; n++) {
    if (await holds()) return;
    await new Promise((resolve) => setTimeout(resolve, 20));
  }
  assert.fail(`not ${what}`);
}

test('it reads, sets, runs, traces and stops a drive', async (t) => {
  const drive = await connected(t);
  assert.match(drive.identity.text, /ZeroHertz/);
  assert.equal(await drive.introduce('node'), true);
  await drive.set('i_d_A', 4.25);
  assert.equal((await drive.get(['i_d_A'])).get('i_d_A'), 4.25);
  await drive.command(RUN, { speed_rad_s: 10, valid_s: 20 });
  await until('running', async () => (await drive.status()).state === 4);
  const roles = await drive.roles();
  assert.equal(roles.names.get(roles.commander), 'node');
  const now = { signal: 'i_d_A', edge: EDGES.now, level: 0 };
  await drive.arm(['i_d_A', 'state'], now, { before: 0, decimation: 2, rows: 100 });
  await until('recorded', async () => (await drive.traceState()).done);
  const record = await drive.traceRecord(await drive.traceState());
  assert.equal(record.t.length, 100);
  assert.ok(Math.abs(record.t[1] - 2 * drive.identity.period_s) < 1e-12);
  assert.ok(record.columns[1].every((state) => state === 4));
  const { values } = await drive.sample(['u_dc_V']);
  assert.ok(Math.abs(values[0] - 283) < 5);
  await drive.command(0);
  assert.equal((await drive.status()).command, 0);
  assert.equal((await drive.faults()).ever, 0);
  assert.equal(await drive.faultRecord(), null);
});

test('a refusal says why', async (t) => {
  const drive = await connected(t);
  await assert.rejects(drive.set('speed_filter_s', 1e9), (error) => error instanceof RefusedError && /it may be .* \.\. /.test(error.message));
  await assert.rejects(drive.set('i_d_A', 9), /i_d_A = 9 A has to be at most 8 A with i_d_max_A = 8 A/);
  await assert.rejects(drive.set('Rs_ohm', 1.2), /protected/);
  await drive.unlock();
  await drive.set('Rs_ohm', 1.2);
  drive.useKey(new Uint8Array(16));
  await assert.rejects(drive.set('i_d_A', 4), WrongKeyError);
});

test('two commands at once, before a session is open, open one', async (t) => {
  const drive = await connected(t);
  const both = () => Promise.all([drive.command(RUN, { valid_s: 20 }), drive.set('i_d_A', 4.25)]);
  await both();
  await drive.command(0);
  drive.forgetSession();
  await both();
  await drive.command(0);
  drive.useKey(new Uint8Array(16));
  const refused = await Promise.allSettled([drive.unlock(), drive.set('i_d_A', 4)]);
  assert.ok(refused.every(({ reason }) => reason instanceof WrongKeyError));
  drive.useKey(DEVELOPMENT_KEY);
  await both(); // one wrong key in all: the drive is not locked out
  await drive.command(0);
});
