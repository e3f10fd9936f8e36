/** The browser's link against what the Python client recorded: tests/tools/test_web_link.py writes the file. */

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';

import { FrameReader, decode, encode } from '../src/link/frame.js';
import { Seal, keyOf, response, siphash24 } from '../src/link/siphash.js';

const hex = (text) => Uint8Array.from(Buffer.from(text, 'hex'));
const text = (bytes) => Buffer.from(bytes).toString('hex');
const recorded = JSON.parse(readFileSync(process.env.ZH_LINK_RECORD, 'utf8'));

test('every recorded frame is written and read as Python does', () => {
  assert.ok(recorded.frames.length > 50);
  for (const { sequence, op, body, wire } of recorded.frames) {
    assert.equal(text(encode({ sequence, op, body: hex(body) })), wire);
    const [frame, ...more] = new FrameReader().feed(hex(wire));
    assert.deepEqual([frame.sequence, frame.op, text(frame.body), more.length], [sequence, op, body, 0]);
  }
});

test('of a garbage stream the same frames come out as in Python, in pieces of any size', () => {
  const stream = hex(recorded.garbage.stream);
  for (const size of [1, 7, 64, stream.length]) {
    const reader = new FrameReader();
    const found = [];
    for (let at = 0; at < stream.length; at += size) found.push(...reader.feed(stream.subarray(at, at + size)));
    const seen = found.map((f) => [f.sequence, f.op, text(f.body)]);
    assert.deepEqual(seen, recorded.garbage.frames);
  }
});

test('no flipped bit gets through', () => {
  const wire = encode({ sequence: 7, op: 0x10, body: Uint8Array.of(0, 1, 0, 255) });
  for (let at = 1; at < wire.length - 1; at++) {
    for (let bit = 0; bit < 8; bit++) {
      const damaged = wire.slice();
      damaged[at] ^= 1 << bit;
      assert.deepEqual(new FrameReader().feed(damaged), []);
    }
  }
  assert.equal(decode(Uint8Array.of(5, 1, 1)), null);
  assert.throws(() => encode({ sequence: 0, op: 0, body: new Uint8Array(245) }), /244/);
});

test('siphash is that of its paper', () => {
  const count = (n) => Uint8Array.from({ length: n }, (_, k) => k);
  assert.equal(siphash24(count(16), count(15)), 0xa129ca6149be45e5n);
});

test('responses and seals are those of Python', () => {
  const { key, nonce, opened, unlocked, requests } = recorded.seal;
  assert.equal(text(response(keyOf(key), BigInt(nonce), false)), opened);
  assert.equal(text(response(keyOf(key), BigInt(nonce), true)), unlocked);
  const seal = new Seal(keyOf(key), BigInt(nonce));
  for (const { request, sealed } of requests) assert.equal(text(seal.of(hex(request))), sealed);
  assert.equal(keyOf('0011'), null);
});
