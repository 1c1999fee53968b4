// A config as text, for `snooker run`.

// Inside a config, keys without a value are those that are absent.
function flow(value) {
  if (/^(circle|box|periodic|channel|equal|maxwell|lattice|random|stop|slide)$/.test(value)) return value;
  if (Array.isArray(value)) return `[${value.map(flow).join(", ")}]`;
  if (value === null || typeof value !== "object") return JSON.stringify(value);
  const given = Object.entries(value).filter(([, inner]) => inner !== null);
  return `{${given.map(([key, inner]) => `${key}: ${flow(inner)}`).join(", ")}}`;
}

// The keys that differ from the defaults, one in a line; of balls in a list, one in a line.
function yamlOf(config, defaults) {
  const lines = [];
  for (const [key, value] of Object.entries(config)) {
    if (JSON.stringify(value) === JSON.stringify(defaults[key])) continue;
    const list = key === "balls" && (Array.isArray(value) ? value : value.list);
    if (!list) {
      lines.push(`${key}: ${flow(value)}`);
      continue;
    }
    lines.push("balls:", ...(list === value ? [] : ["  list:"]));
    for (const ball of list) lines.push(`${list === value ? "  " : "    "}- ${flow(ball)}`);
  }
  return `${lines.join("\n")}\n`;
}
