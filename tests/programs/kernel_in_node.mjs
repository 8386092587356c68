// Marches a block by the kernel of pages: node kernel_in_node.mjs WASM BLOCK SIZE STEPS PLACE; prints a number a step.
import { readFileSync } from "node:fs";

const [wasm, block, size, steps, place] = process.argv.slice(2);
const { exports } = (await WebAssembly.instantiate(readFileSync(wasm))).instance;
const base = Math.ceil(exports.__heap_base.value / 16) * 16, bytes = 8 * Number(size);
const lacking = base + bytes - exports.memory.buffer.byteLength;
if (lacking > 0) exports.memory.grow(Math.ceil(lacking / 65536));
const numbers = new Float64Array(exports.memory.buffer, base, Number(size)), given = readFileSync(block);
numbers.fill(0);
numbers.set(new Float64Array(given.buffer.slice(given.byteOffset, given.byteOffset + given.length)));
for (let k = 0; k < Number(steps); k++) {
  if (exports.march(base, 1)) process.exit(4);
  console.log(numbers[Number(place)]);
}
