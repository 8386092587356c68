"use strict";
// Numbers of the page, packed as base64 by packed_numbers.py and by plotly.
window.gapbeam = { scenes: [] };
window.gapbeam.numbersOf = (values) => {
  if (!values || values.bdata === undefined) return values || [];
  const bytes = Uint8Array.from(atob(values.bdata), (letter) => letter.charCodeAt(0));
  const kinds = { i2: Int16Array, f4: Float32Array, f8: Float64Array };
  return kinds[values.dtype] ? new kinds[values.dtype](bytes.buffer) : [];
};
// Round numbers between two ends, and the digits behind the point that they need.
window.gapbeam.ticks = (low, high, most) => {
  const rough = (high - low) / most || 1, decade = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].find((one) => one * decade >= rough * (1 - 1e-9)) * decade, found = [];
  for (let k = Math.ceil(low / step - 1e-3); k * step <= high + 1e-3 * step; k += 1) found.push(k * step);
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  return found.map((value) => [value, value.toFixed(digits).replace("-", "−")]);
};
