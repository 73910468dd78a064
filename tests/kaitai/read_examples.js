// SPDX-License-Identifier: MIT
// Compiles a .ksy file and parses the worked examples of the protocol's document with it. Every frame is written again from
// the fields that were parsed, in the order of the document's tables of messages, and must be the same bytes; so field, type
// and order are compared, and not by hand. The mesh list in the examples is parsed and written again in the same way.
'use strict';

const fs = require('node:fs');
const yaml = require('js-yaml');
const compiler = require('kaitai-struct-compiler');
const KaitaiStream = require('kaitai-struct/KaitaiStream');

// The runtime reads a u64 as a double, which holds 53 bits only.
KaitaiStream.prototype.readU8le = function readU8le() {
  const low = BigInt(this.readU4le());
  return (BigInt(this.readU4le()) << 32n) | low;
};

function fail(text) {
  console.error(`check: ${text}`);
  process.exit(1);
}

function equal(what, expected, got) {
  if (expected !== got) fail(`${what}: ${expected} in the document, ${got} by the .ksy`);
}

/** Compiles `text` and returns the root class. */
async function compile(text) {
  const files = await compiler.compile('javascript', yaml.load(text), null, false);
  const module = { exports: {} };
  new Function('module', 'exports', 'require', files['Pmcd.js'])(module, module.exports, (name) =>
    name.endsWith('KaitaiStream') ? KaitaiStream : fail(`the parser asks for ${name}`));
  return module.exports.Pmcd || module.exports;
}

/** [{who, channel, name, bytes}] of all ```hex blocks. */
function examples(document) {
  const frames = [];
  for (const [, block] of document.matchAll(/```hex\n([^]*?)```/g)) {
    for (const line of block.split('\n')) {
      const title = line.match(/^# (client|server), (\w+): (\w+)$/);
      if (title) frames.push({ who: title[1], channel: title[2], name: title[3], hex: '' });
      else frames[frames.length - 1].hex += line.replace(/\s/g, '');
    }
  }
  return frames.map((frame) => ({ ...frame, bytes: Buffer.from(frame.hex, 'hex') }));
}

/** {name: {type, fields: [{name, kind}]}} from the tables whose rows begin with a type. */
function messages(document) {
  const found = {};
  for (const [, type, name, fields] of document.matchAll(/^\| (0x[0-9a-f]{4}) \| (\w+) \| [^|]+ \| ([^|]+) \|$/gm)) {
    const list = fields.trim() === 'none' ? [] : fields.replace(/\([^)]*\)/g, '').split(',').map((f) => f.trim());
    found[name] = { type: Number(type), fields: list.map(field) };
  }
  return found;
}

function field(text) {
  if (text.startsWith('magic')) return { name: 'magic', kind: 'magic' };
  if (text === 'options') return { name: text, kind: text };
  const [, kind, name] = text.match(/^(u8|u16|u32|u64|str8|str16|rest|16 bytes) (.+)$/) || fail(`field ${text}`);
  return { name: name.trim(), kind };
}

const camel = (name) => name.replace(/[_ ](\w)/g, (_, letter) => letter.toUpperCase());
const widths = { u8: 1, u16: 2, u32: 4, u64: 8 };

function number(value, bytes) {
  const out = Buffer.alloc(8);
  out.writeBigUInt64LE(BigInt(value));
  return out.subarray(0, bytes);
}

/** The bytes of a field that was parsed. */
function written(kind, value) {
  if (widths[kind]) return number(value, widths[kind]);
  if (kind === 'str8' || kind === 'str16') {
    const text = Buffer.from(value.text, 'utf-8');
    return Buffer.concat([number(text.length, kind === 'str8' ? 1 : 2), text]);
  }
  if (kind === 'options') {
    return Buffer.concat(value.flatMap((option) => [written('str8', option.name), written('str8', option.value)]));
  }
  return Buffer.from(value);
}

function body(parsed, fields) {
  return Buffer.concat(fields.map(({ name, kind }) => {
    const inVersion = name === 'major' || name === 'minor';
    const value = (inVersion ? parsed.version : parsed)[camel(name)];
    if (value === undefined) fail(`${parsed.constructor.name} has no field ${name}`);
    return written(kind, value);
  }));
}

/** Reads and writes a page of the mesh list. */
function checkList(Pmcd, bytes) {
  const list = new Pmcd.MeshList(new KaitaiStream(bytes), null, null);
  const out = [number(list.matches, 4), number(list.remaining, 4), number(list.count, 4)];
  for (const mesh of list.meshes) {
    out.push(written('str8', mesh.name), number(mesh.generation, 8), number(mesh.vertices, 4), number(mesh.faces, 4),
      number(mesh.levels, 4), number(mesh.bytes, 8), Buffer.from([mesh.flags, mesh.bits, mesh.formatVersion]));
    for (const value of mesh.box) {
      const double = Buffer.alloc(8);
      double.writeDoubleLE(value);
      out.push(double);
    }
  }
  equal('the mesh list', bytes.toString('hex'), Buffer.concat(out).toString('hex'));
  if (list.meshes.length === 0) fail('the mesh list of the examples is empty');
}

async function main([ksy, markdown]) {
  const document = fs.readFileSync(markdown, 'utf-8');
  const Pmcd = await compile(fs.readFileSync(ksy, 'utf-8'));
  const known = messages(document);
  const frames = examples(document);
  const ids = new Set();
  let lists = 0;
  for (const { who, channel, name, bytes } of frames) {
    const where = `${who}, ${channel}: ${name}`;
    const parsed = new Pmcd(new KaitaiStream(bytes)).frames;
    equal(`${where}: frames`, 1, parsed.length);
    equal(`${where}: type`, known[name].type, parsed[0].type);
    equal(`${where}: length`, bytes.length - 4, parsed[0].length);
    equal(`${where}: body`, bytes.subarray(6).toString('hex'), body(parsed[0].body, known[name].fields).toString('hex'));
    if (name === 'get_mesh_list') ids.add(parsed[0].body.id);
    if (name === 'chunk' && ids.has(parsed[0].body.id) && parsed[0].body.handle === 0) {
      checkList(Pmcd, Buffer.from(parsed[0].body.bytes));
      lists += 1;
    }
  }
  const requests = Buffer.concat(frames.filter((f) => f.who === 'client' && f.channel === 'request').map((f) => f.bytes));
  equal('frames of a whole stream', frames.filter((f) => f.who === 'client' && f.channel === 'request').length,
    new Pmcd(new KaitaiStream(requests)).frames.length);
  if (frames.length < 20 || lists < 1) fail(`only ${frames.length} frames and ${lists} mesh lists in the examples`);
  console.log(`${frames.length} frames of the worked examples and ${lists} mesh list: the same bytes`);
}

main(process.argv.slice(2)).catch((wrong) => fail(wrong.stack));
