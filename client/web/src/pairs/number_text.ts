// Numbers as the command line writes them: the fewest digits that are read as the same number, with
// ".0" where there are no others, and exponents of two digits or more.

// The digits of a positive number, and how many of them stand before the point.
function digitsOf(value: number): { digits: string; before: number } {
  const [mantissa, exponent] = value.toExponential().split('e') as [string, string];
  return { digits: mantissa.replace('.', ''), before: Number(exponent) + 1 };
}

function withExponent(digits: string, before: number): string {
  const exponent = before - 1;
  const mantissa = digits.length > 1 ? `${digits[0]}.${digits.slice(1)}` : digits;
  const sign = exponent < 0 ? '-' : '+';
  return `${mantissa}e${sign}${String(Math.abs(exponent)).padStart(2, '0')}`;
}

function positiveText(value: number): string {
  const { digits, before } = digitsOf(value);
  if (before > 15 || before <= -4) return withExponent(digits, before);
  if (before <= 0) return `0.${'0'.repeat(-before)}${digits}`;
  if (digits.length <= before) return `${digits}${'0'.repeat(before - digits.length)}.0`;
  return `${digits.slice(0, before)}.${digits.slice(before)}`;
}

/** Requires: a finite number. */
export function numberText(value: number): string {
  if (value === 0) return Object.is(value, -0) ? '-0.0' : '0.0';
  return value < 0 ? `-${positiveText(-value)}` : positiveText(value);
}
