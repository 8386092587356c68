"use strict";
// Numbers of the page, packed as base64 by packed_numbers.py and by plotly.
window.gapbeam = { scenes: [] };
window.gapbeam.numbersOf = (values) => {
  if (!values || values.bdata === undefined) return values || [];
  const bytes = Uint8Array.from(atob(values.bdata), (letter) => letter.charCodeAt(0));
  const kinds = { i2: Int16Array, f4: Float32Array, f8: Float64Array };
  return kinds[values.dtype] ? new kinds[values.dtype](bytes.buffer) : [];
};
