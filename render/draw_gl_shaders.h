// draw_gl_shaders.h - what one cell shows to a fragment, in GLSL
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_RENDER_DRAW_GL_SHADERS_H
#define VT_RENDER_DRAW_GL_SHADERS_H

// The definition is octree.h's ("compositing"); octree/composite.c says the same in C and explains the formulas. Bodies
// without #version, valid as OpenGL ES 3.00 and as OpenGL 3.30; the maker puts in front of them
//   VIEWS      chosen views, 0: flat;  TILES  defined if their textures are tiles, else they are view textures
//   FIELD      defined if a cell is what is interpolated between its corners, else it is constant (no TILES)
//   TEXELS     texels along a tile's edge; ONE_ROW defined if a tile never straddles two rows of its texture
//   PACKED     defined if textures are codewords;  GEOMETRIC  defined for VT_BLEND_GEOMETRIC
// Lengths are cell edges from the root's centre. Linear arrays lie in array textures of 2048 x 2048 elements a layer.

static const char vt_shader_shared[] =
    "uniform vec3 right, down, forward;\n" // the camera's axes
    "uniform vec3 foot;\n"                 // where the camera's axis pierces the plane of depth `depth`
    "uniform float depth;\n"               // of the root's centre before the camera
    "ivec3 place(uint i) { return ivec3(int(i & 2047u), int((i >> 11) & 2047u), int(i >> 22)); }\n";

static const char vt_vertex_shader[] =
    "uniform usampler2DArray cells;\n"
    "uniform float middle_cell;\n"
    "uniform vec2 focal, principal, size;\n"
    "flat out vec3 centre;\n"
    "uint cell;\n" // an index is 4 * cell + corner
    "#if defined(TILES)\n"
    "uniform usampler2DArray tile_of, codes;\n"
    "uniform uint cell_count;\n"
    "uniform int view[VIEWS];\n"
    "uniform mat3 view_m[VIEWS];\n"     // homogeneous pixel of a view = m X + b
    "uniform vec3 view_b[VIEWS];\n"
    "uniform float texel_rate[VIEWS];\n" // texels per pixel at depth 1
    "uniform float grid;\n"             // vt_tiles.grid
    "flat out uvec4 board[VIEWS];\n"    // left, top, texels per pixel (0: no tile) as bits; tile or codewords
    "void find_board(int v) {\n"
    "  uint tile = texelFetch(tile_of, place(uint(view[v]) * cell_count + cell), 0).r;\n"
    "  vec3 h = view_m[v] * centre + view_b[v];\n"
    "  board[v] = uvec4(0u);\n"
    "  if (tile == 0xffffffffu || !(h.z > 0.0)) return;\n"
    "  float scale = h.z * texel_rate[v];\n"
    "  vec2 corner = h.xy / h.z - 0.5 * float(TEXELS) / scale;\n"
    "  if (grid > 0.0) {\n" // which of the grid's corners is told by what it leaves when divided by 4: no rounding decides
    "    vec2 rest = vec2(float(tile >> 28 & 3u), float(tile >> 30));\n"
    "    corner = floor(h.xy / (h.z * grid) - (0.5 * float(TEXELS) - 0.5));\n"
    "    corner = grid * (corner + mod(rest - corner + 2.0, 4.0) - 2.0);\n"
    "    scale = 1.0 / grid;\n"
    "    tile &= 0x0fffffffu;\n"
    "  }\n"
    "#ifdef PACKED\n"
    "  tile = texelFetch(codes, place(tile), 0).r;\n"
    "#endif\n"
    "  board[v] = uvec4(floatBitsToUint(corner), floatBitsToUint(scale), tile);\n"
    "}\n"
    "#elif defined(FIELD)\n"
    "uniform usampler2DArray corners;\n" // two elements a cell
    "uniform sampler2DArray corner_values;\n"
    "flat out vec4 corner[8];\n"
    "#else\n"
    "uniform sampler2DArray looks;\n"
    "flat out vec4 look;\n"
    "#endif\n"
    // The rectangle around the projection of the box around the cell along the camera's axes, in front of a plane so
    // near that what it cuts off is shorter than any chord that counts. Cells beside the eye get what they need of the
    // picture, no more: an eye inside the crown pays for a handful of large quads.
    "void main() {\n"
    "  cell = uint(gl_VertexID) >> 2;\n"
    "  centre = vec3(texelFetch(cells, place(cell), 0).xyz) - middle_cell;\n"
    "  vec3 c = vec3(dot(right, centre - foot), dot(down, centre - foot), depth + dot(forward, centre));\n"
    "  vec3 e = 0.5 * vec3(dot(abs(right), vec3(1)), dot(abs(down), vec3(1)), dot(abs(forward), vec3(1)));\n"
    "  float nearest = max(c.z - e.z, 1e-5), farthest = c.z + e.z;\n"
    "  vec2 low = c.xy - e.xy, high = c.xy + e.xy;\n"
    "  low /= vec2(low.x < 0.0 ? nearest : farthest, low.y < 0.0 ? nearest : farthest);\n"
    "  high /= vec2(high.x > 0.0 ? nearest : farthest, high.y > 0.0 ? nearest : farthest);\n"
    "  low = max((low * focal + principal - 0.01) * 2.0 / size - 1.0, -1.0);\n"
    "  high = min((high * focal + principal + 0.01) * 2.0 / size - 1.0, 1.0);\n"
    "  gl_Position = vec4(2.0, 2.0, 0.0, 1.0);\n" // off the picture
    "  if (!(farthest > nearest) || !(low.x < high.x) || !(low.y < high.y)) return;\n"
    "  gl_Position.x = (gl_VertexID & 1) == 0 ? low.x : high.x;\n"
    "  gl_Position.y = (gl_VertexID & 2) == 0 ? low.y : high.y;\n"
    "#if defined(TILES)\n"
    "  for (int v = 0; v < VIEWS; v++) find_board(v);\n"
    "#elif defined(FIELD)\n"
    "  if ((gl_VertexID & 2) == 0) return;\n" // no triangle's last vertex: flat values are not taken from here
    "  for (uint part = 0u; part < 2u; part++) {\n"
    "    uvec4 four = texelFetch(corners, place(2u * cell + part), 0);\n"
    "    for (int i = 0; i < 4; i++) corner[4 * int(part) + i] = texelFetch(corner_values, place(four[i]), 0).gbar;\n"
    "  }\n"
    "#else\n"
    "  look = texelFetch(looks, place(cell), 0);\n"
    "#endif\n"
    "}\n";

static const char vt_fragment_shader[] =
    "uniform vec4 lens;\n" // of a pixel to the plane at depth 1: factor, offset
    "flat in vec3 centre;\n"
    "layout(location = 0) out vec4 colour;\n"
    "#if VIEWS > 0\n"
    "uniform mat3 view_m[VIEWS];\n"
    "uniform vec3 view_b[VIEWS];\n"
    "uniform float weight[VIEWS];\n"
    "#endif\n"
    "#if defined(TILES)\n"
    "flat in uvec4 board[VIEWS];\n"
    "#ifdef PACKED\n"
    "uniform sampler2DArray alphas, colours;\n"
    "#else\n"
    "uniform sampler2DArray texels;\n"
    "#endif\n"
    "float alpha_of(float a) { return min(a, 254.5 / 255.0); }\n"
    "ivec3 texel_place(uint tile, ivec2 at) {\n"
    "#ifdef ONE_ROW\n"
    "  return place(tile * uint(TEXELS * TEXELS)) + ivec3(at.y * TEXELS + at.x, 0, 0);\n"
    "#else\n"
    "  return place(tile * uint(TEXELS * TEXELS) + uint(at.y * TEXELS + at.x));\n"
    "#endif\n"
    "}\n"
    "vec4 texel(uint tile, ivec2 at) {\n"
    "#ifdef PACKED\n"
    "  float a = texelFetch(alphas, texel_place(tile & 0xffffu, at), 0).r;\n"
    "  return vec4(texelFetch(colours, texel_place(tile >> 16, at), 0).rgb, alpha_of(a));\n"
    "#else\n"
    "  vec4 t = texelFetch(texels, texel_place(tile, at), 0);\n"
    "  return vec4(t.rgb, alpha_of(t.a));\n"
    "#endif\n"
    "}\n"
    "vec4 look_up(uvec4 b, vec3 h) {\n"
    "  vec2 pixel = h.xy / max(h.z, 1e-6);\n"
    "  vec2 at = (pixel - uintBitsToFloat(b.xy)) * uintBitsToFloat(b.z) - 0.5;\n"
    "  at = clamp(at, 0.0, float(TEXELS - 1));\n"
    "  ivec2 first = ivec2(at), last = min(first + 1, TEXELS - 1);\n"
    "  vec2 f = at - vec2(first);\n"
    "  vec4 above = mix(texel(b.w, first), texel(b.w, ivec2(last.x, first.y)), f.x);\n"
    "  vec4 below = mix(texel(b.w, ivec2(first.x, last.y)), texel(b.w, last), f.x);\n"
    "  return mix(above, below, f.y);\n"
    "}\n"
    "vec4 shown(vec3 x, float chord) {\n"
    "  float total = 0.0, logs = 0.0;\n"
    "  vec4 sum = vec4(0);\n"
    "  for (int v = 0; v < VIEWS; v++) {\n"
    "    if (board[v].z == 0u) continue;\n"
    "    vec4 t = look_up(board[v], view_m[v] * x + view_b[v]);\n"
    "    float s = -log(1.0 - t.a);\n"
    "    total += weight[v];\n"
    "#ifdef GEOMETRIC\n"
    "    logs += weight[v] * log(s + 1e-4);\n"
    "    sum += weight[v] * s * vec4(t.rgb, 1.0);\n"
    "#else\n"
    "    sum += weight[v] * (1.0 - exp(-s * chord)) * vec4(t.rgb, 1.0);\n"
    "#endif\n"
    "  }\n"
    "  if (!(sum.a > 0.0)) return vec4(0);\n"
    "#ifdef GEOMETRIC\n"
    "  return (1.0 - exp(-max(exp(logs / total) - 1e-4, 0.0) * chord)) * vec4(sum.rgb / sum.a, 1.0);\n"
    "#else\n"
    "  return sum / total;\n"
    "#endif\n"
    "}\n"
    "#else\n"
    "#if defined(FIELD)\n"
    "flat in vec4 corner[8];\n"
    "vec4 look_at(vec3 f) {\n" // f: the place within the cell, 0..1
    "  vec4 near = mix(mix(corner[0], corner[1], f.x), mix(corner[4], corner[5], f.x), f.z);\n"
    "  vec4 far = mix(mix(corner[2], corner[3], f.x), mix(corner[6], corner[7], f.x), f.z);\n"
    "  return mix(near, far, f.y);\n"
    "}\n"
    "#else\n"
    "flat in vec4 look;\n"
    "vec4 look_at(vec3 f) { return look; }\n"
    "#endif\n"
    "#if VIEWS > 0\n"
    "uniform usampler2DArray ratios;\n"
    "uniform vec4 kept[VIEWS];\n" // centre of the first pixel kept, and from there to that of the last
    "uniform vec2 photograph[VIEWS];\n" // its size
    "uniform uint first_code[VIEWS];\n"
    "uniform float linear;\n" // 1: R is interpolated, 0: ln R
    "float code(uint at) {\n" // or R / 50
    "  float c = float(texelFetch(ratios, place(at), 0).r);\n"
    "  return linear > 0.5 ? exp(LOG_RATIO_STEP * (c - 255.0)) : c;\n"
    "}\n"
    "float log_ratio(vec3 x) {\n"
    "  float sum = 0.0, weights = 0.0;\n"
    "  for (int v = 0; v < VIEWS; v++) {\n"
    "    vec3 h = view_m[v] * x + view_b[v];\n"
    "    vec2 pixel = h.xy / max(h.z, 1e-6);\n"
    "    if (!(h.z > 1e-6 && weight[v] > 0.0)) continue;\n"
    "    if (any(lessThan(pixel, vec2(0))) || any(greaterThan(pixel, photograph[v]))) continue;\n"
    "    vec2 p = clamp(pixel - kept[v].xy, vec2(0), kept[v].zw);\n"
    "    uvec2 first = uvec2(p), last = min(first + 1u, uvec2(kept[v].zw));\n"
    "    vec2 f = p - vec2(first);\n"
    "    uint columns = uint(kept[v].z) + 1u;\n"
    "    uint row = first_code[v] + first.y * columns, below = first_code[v] + last.y * columns;\n"
    "    float above = mix(code(row + first.x), code(row + last.x), f.x);\n"
    "    float here = mix(above, mix(code(below + first.x), code(below + last.x), f.x), f.y);\n"
    "    sum += weight[v] * (linear > 0.5 ? 255.0 + log(here) / LOG_RATIO_STEP : here);\n"
    "    weights += weight[v];\n"
    "  }\n"
    "  return weights > 0.0 ? LEAST_LOG_RATIO + LOG_RATIO_STEP * (sum / weights) : 0.0;\n"
    "}\n"
    "#else\n"
    "float log_ratio(vec3 x) { return 0.0; }\n"
    "#endif\n"
    "#endif\n"
    "void main() {\n"
    "  vec2 q = gl_FragCoord.xy * lens.xy + lens.zw;\n"
    "  vec3 aside = q.x * right + q.y * down, d = forward + aside;\n"
    "  float plane = dot(forward, centre), z = depth + plane;\n"
    "  vec3 x = foot + plane * forward + z * aside, from = x - centre;\n"
    "  vec3 safe = mix(d, vec3(1e-9), lessThan(abs(d), vec3(1e-9)));\n"
    "  vec3 t0 = (-0.5 - from) / safe, t1 = (0.5 - from) / safe, enter = min(t0, t1), leave = max(t0, t1);\n"
    "  float near = max(max(enter.x, enter.y), max(enter.z, -z)), far = min(min(leave.x, leave.y), leave.z);\n"
    "  float chord = (far - near) * length(d);\n"
    "  if (!(chord > 1e-5)) discard;\n"
    "#if defined(TILES)\n"
    "  colour = shown(x, chord);\n"
    "#else\n"
    "  vec3 middle = from + 0.5 * (near + far) * d;\n" // from the cell's centre
    "  vec4 seen = look_at(clamp(middle + 0.5, 0.0, 1.0));\n"
    "  colour = (1.0 - exp(-seen.a * exp(log_ratio(centre + middle)) * chord)) * vec4(seen.rgb, 1.0);\n"
    "#endif\n"
    "}\n";

#endif
