// The programs of the graphics processor.

const LIGHT = `
vec3 lit(vec3 color, vec3 normal, vec3 toEye) {
  vec3 key = normalize(vec3(-0.35, -0.55, 0.9));
  float sky = 0.5 + 0.5 * normal.z;
  float sun = max(dot(normal, key), 0.0);
  float shine = pow(max(dot(normal, normalize(key + toEye)), 0.0), 40.0);
  return color * (mix(0.42, 0.62, sky) + 0.52 * sun) + 0.12 * shine;
}`;

// Bodies: a vertex knows its node and its corner; where these are stands in two textures.
export const BODY = {
  vertex: `#version 300 es
precision highp float;
layout(location = 0) in uint node;
layout(location = 1) in uint corner;
layout(location = 2) in vec4 tint;
uniform highp sampler2D places, normals;
uniform mat4 camera;
uniform vec4 floor_;
uniform bool shadow;
out vec3 place, normal, bary;
out vec4 color;
out float value;
vec4 entry(highp sampler2D table, uint k) { return texelFetch(table, ivec2(int(k) & 1023, int(k) >> 10), 0); }
void main() {
  vec4 p = entry(places, node);
  place = p.xyz;
  value = p.w;
  normal = entry(normals, corner).xyz;
  bary = vec3(gl_VertexID % 3 == 0, gl_VertexID % 3 == 1, gl_VertexID % 3 == 2);
  color = tint;
  if (shadow) {
    vec3 sun = normalize(vec3(-0.35, -0.55, 0.9));
    float height = max(dot(floor_.xyz, place) - floor_.w, 0.0);
    place -= sun * (height / dot(floor_.xyz, sun)) - 0.0005 * floor_.xyz;
  }
  gl_Position = camera * vec4(place, 1.0);
}`,
  fragment: `#version 300 es
precision highp float;
in vec3 place, normal, bary;
in vec4 color;
in float value;
uniform vec3 eye;
uniform bool shadow, wire;
uniform sampler2D map;
out vec4 pixel;
${LIGHT}
void main() {
  if (shadow) { pixel = vec4(0.1, 0.13, 0.18, 0.22); return; }
  vec3 n = normalize(gl_FrontFacing ? normal : -normal);
  vec3 base = value < 0.0 ? color.rgb : texture(map, vec2(value * 0.996 + 0.002, 0.5)).rgb;
  vec3 shade = lit(base, n, normalize(eye - place));
  if (wire) {
    vec3 near = smoothstep(vec3(0.0), 1.2 * fwidth(bary), bary);
    shade = mix(0.45 * shade, shade, min(near.x, min(near.y, near.z)));
  }
  pixel = vec4(shade, 1.0);
}`,
};

// Spheres and boxes: a unit shape, sized, turned and shifted.
export const SOLID = {
  vertex: `#version 300 es
precision highp float;
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 direction;
uniform mat4 camera;
uniform mat3 turn;
uniform vec3 center, size;
uniform vec4 floor_;
uniform bool shadow;
out vec3 place, normal;
void main() {
  place = turn * (position * size) + center;
  normal = turn * (direction / size);
  if (shadow) {
    vec3 sun = normalize(vec3(-0.35, -0.55, 0.9));
    float height = max(dot(floor_.xyz, place) - floor_.w, 0.0);
    place -= sun * (height / dot(floor_.xyz, sun)) - 0.0005 * floor_.xyz;
  }
  gl_Position = camera * vec4(place, 1.0);
}`,
  fragment: `#version 300 es
precision highp float;
in vec3 place, normal;
uniform vec3 eye, tint;
uniform bool shadow;
out vec4 pixel;
${LIGHT}
void main() {
  pixel = shadow ? vec4(0.1, 0.13, 0.18, 0.22) : vec4(lit(tint, normalize(normal), normalize(eye - place)), 1.0);
}`,
};

// Planes: a disc about a point, with a grid, that fades into the background.
export const PLANE = {
  vertex: `#version 300 es
precision highp float;
layout(location = 0) in vec2 position;
uniform mat4 camera;
uniform vec3 center, across, along;
uniform float radius;
out vec2 at;
out vec3 place;
void main() {
  at = position;
  place = center + radius * (position.x * across + position.y * along);
  gl_Position = camera * vec4(place, 1.0);
}`,
  fragment: `#version 300 es
precision highp float;
in vec2 at;
in vec3 place;
uniform vec3 origin, across, along;
uniform float cell;
out vec4 pixel;
void main() {
  vec2 p = vec2(dot(place - origin, across), dot(place - origin, along)) / cell;
  vec2 width = max(fwidth(p), 1e-4);
  vec2 d = abs(fract(p - 0.5) - 0.5) / width;
  float line = (1.0 - min(min(d.x, d.y), 1.0)) * clamp(0.35 / max(width.x, width.y), 0.0, 1.0);
  float fade = smoothstep(1.0, 0.25, length(at));
  pixel = vec4(mix(vec3(0.886, 0.890, 0.896), vec3(0.74, 0.76, 0.79), 0.55 * line), fade);
}`,
};
