// draw_gl_epoxy.c - drawing a level with OpenGL, without a window (EGL; libepoxy finds the functions)
// SPDX-License-Identifier: BSD-3-Clause
//
// One quad per cell, far to near, blended premultiplied into a floating point picture (8 bits would lose a little at
// each of some hundred layers), read back. The quads are indexed, not instanced: instances of four vertices leave most
// lanes of a vector or a warp empty (on a software driver of 8 lanes they took 1.3 times as long). All data of a level
// are uploaded when it is first drawn; a picture sends its uniforms, and the order of the cells if that changed.
// Nothing here goes beyond OpenGL ES 3.0: linear arrays live in array textures of 2048 x 2048 elements a layer, sizes
// that every driver has.
//
// EGL is called directly: libepoxy's EGL entry points want a current display to find the extensions, which is what is
// being looked for. A display is never terminated: all renderers of the process share it. Whatever context the caller
// has current on this thread is put back after every call.

#include "render/draw_gl.h"

#include "render/draw_gl_data.h"
#include "render/draw_gl_shaders.h"

#include <epoxy/gl.h> // before EGL, whose headers then leave out the types that this one brings
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <string.h>

#define LAYER_EDGE 2048 // elements; the shaders know it too
#define MAX_DISPLAYS 16

// How a level is drawn: what a cell is, and where its opacity comes from.
typedef enum drawing_kind { DRAW_TILES_SUM, DRAW_TILES_GEOMETRIC, DRAW_CONSTANT, DRAW_FIELD, DRAWING_KINDS } drawing_kind;

// Arrays in the memory of the driver, in the order of the shaders' samplers.
typedef enum level_array { CELLS, TILE_OF, CODES, TEXELS, LOOKS, CORNERS, CORNER_VALUES, RATIOS, LEVEL_ARRAYS } level_array;
static const char *const sampler_names[] = {"cells", "tile_of", "codes", "texels", "looks", "corners", "corner_values",
                                            "ratios", "alphas", "colours"}; // the last two belong to all levels

typedef struct level_textures {
  GLuint arrays[LEVEL_ARRAYS]; // 0: not yet needed, or never
} level_textures;

struct vt_gl {
  const vt_tree *tree;
  EGLDisplay display;
  EGLContext context;
  EGLSurface surface; // EGL_NO_SURFACE where the driver can do without
  bool is_es, software; // software: drawn by the processor
  char name[224];
  GLenum picture_format;         // GL_RGBA32F, or GL_RGBA16F where the driver cannot blend more
  int largest_picture, layers;   // limits of the driver
  int picture_width, picture_height;
  GLuint vertex_array, list, framebuffer, picture, alphas, colours;
  GLuint programs[DRAWING_KINDS][VT_MAX_BLEND_VIEWS + 1]; // by number of views, none: flat; 0: not yet made
  level_textures levels[VT_MAX_LEVEL + 1];
};

// ---- the current context

typedef struct current_context { // what the caller had
  EGLenum api;
  EGLDisplay display;
  EGLContext context;
  EGLSurface draw, read;
} current_context;

static current_context get_current(void) {
  return (current_context){eglQueryAPI(), eglGetCurrentDisplay(), eglGetCurrentContext(),
                           eglGetCurrentSurface(EGL_DRAW), eglGetCurrentSurface(EGL_READ)};
}

static void put_back(const current_context *old, EGLDisplay display) {
  if (old->context != EGL_NO_CONTEXT) eglMakeCurrent(old->display, old->draw, old->read, old->context);
  else eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  eglBindAPI(old->api);
}

static bool make_current(const vt_gl *gl) {
  eglBindAPI(gl->is_es ? EGL_OPENGL_ES_API : EGL_OPENGL_API);
  return eglMakeCurrent(gl->display, gl->surface, gl->surface, gl->context) == EGL_TRUE;
}

static bool has_word(const char *words, const char *word) {
  size_t length = strlen(word);
  for (const char *at = words; at && (at = strstr(at, word)); at += length)
    if ((at == words || at[-1] == ' ') && (at[length] == ' ' || !at[length])) return true;
  return false;
}

static const char *egl_error(void) {
  switch (eglGetError()) {
  case EGL_SUCCESS: return "no error";
  case EGL_NOT_INITIALIZED: return "EGL_NOT_INITIALIZED";
  case EGL_BAD_ACCESS: return "EGL_BAD_ACCESS";
  case EGL_BAD_ALLOC: return "EGL_BAD_ALLOC";
  case EGL_BAD_ATTRIBUTE: return "EGL_BAD_ATTRIBUTE";
  case EGL_BAD_CONFIG: return "EGL_BAD_CONFIG";
  case EGL_BAD_MATCH: return "EGL_BAD_MATCH";
  case EGL_CONTEXT_LOST: return "EGL_CONTEXT_LOST";
  default: return "an EGL error";
  }
}

static vt_status check_gl(vt_context *context, const vt_gl *gl, const char *what) {
  GLenum error = glGetError();
  if (!error) return VT_OK;
  while (glGetError()) {}
  if (error == GL_OUT_OF_MEMORY)
    return vt_fail(context, VT_OUT_OF_MEMORY, "OpenGL (%s): no memory for %s; draw a coarser level, or on the CPU",
                   gl->name, what);
  return vt_fail(context, VT_FAILED, "OpenGL (%s): error 0x%04x at %s; draw on the CPU", gl->name, (unsigned)error,
                 what);
}

// ---- making a context

// Displays to try: none but the driver's memory, each device, whatever the system calls its default.
static int list_displays(EGLDisplay displays[MAX_DISPLAYS]) {
  const char *words = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  PFNEGLGETPLATFORMDISPLAYEXTPROC get_display = NULL;
  PFNEGLQUERYDEVICESEXTPROC query_devices = NULL;
  int count = 0;
  if (has_word(words, "EGL_EXT_platform_base"))
    get_display = (PFNEGLGETPLATFORMDISPLAYEXTPROC)eglGetProcAddress("eglGetPlatformDisplayEXT");
  if (get_display && has_word(words, "EGL_MESA_platform_surfaceless"))
    displays[count++] = get_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, NULL);
  if (get_display && has_word(words, "EGL_EXT_platform_device"))
    query_devices = (PFNEGLQUERYDEVICESEXTPROC)eglGetProcAddress("eglQueryDevicesEXT");
  EGLDeviceEXT devices[MAX_DISPLAYS - 2];
  EGLint device_count = 0;
  if (query_devices && query_devices(MAX_DISPLAYS - 2, devices, &device_count))
    for (int i = 0; i < device_count; i++) displays[count++] = get_display(EGL_PLATFORM_DEVICE_EXT, devices[i], NULL);
  displays[count++] = eglGetDisplay(EGL_DEFAULT_DISPLAY);
  return count;
}

static void close_context(vt_gl *gl) {
  if (gl->context != EGL_NO_CONTEXT) {
    eglMakeCurrent(gl->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    eglDestroyContext(gl->display, gl->context);
  }
  if (gl->surface != EGL_NO_SURFACE) eglDestroySurface(gl->display, gl->surface);
  gl->context = EGL_NO_CONTEXT;
  gl->surface = EGL_NO_SURFACE;
}

// A current context of one API on an initialised display. False, and nothing left, if there is none.
static bool open_api(vt_gl *gl, bool es) {
  const char *words = eglQueryString(gl->display, EGL_EXTENSIONS);
  if (!eglBindAPI(es ? EGL_OPENGL_ES_API : EGL_OPENGL_API)) return false;
  EGLint wanted[] = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE, es ? EGL_OPENGL_ES3_BIT : EGL_OPENGL_BIT,
                     EGL_NONE};
  EGLConfig config = EGL_NO_CONFIG_KHR;
  EGLint configs = 0;
  if (!eglChooseConfig(gl->display, wanted, &config, 1, &configs) || !configs) config = EGL_NO_CONFIG_KHR;
  EGLint desktop[] = {EGL_CONTEXT_MAJOR_VERSION, 3, EGL_CONTEXT_MINOR_VERSION, 3, EGL_CONTEXT_OPENGL_PROFILE_MASK,
                      EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
  EGLint embedded[] = {EGL_CONTEXT_MAJOR_VERSION, 3, EGL_CONTEXT_MINOR_VERSION, 0, EGL_NONE};
  gl->is_es = es;
  gl->context = eglCreateContext(gl->display, config, EGL_NO_CONTEXT, es ? embedded : desktop);
  if (gl->context == EGL_NO_CONTEXT) return false;
  if (!has_word(words, "EGL_KHR_surfaceless_context")) {
    EGLint size[] = {EGL_WIDTH, 16, EGL_HEIGHT, 16, EGL_NONE};
    gl->surface = eglCreatePbufferSurface(gl->display, config, size);
  }
  if (make_current(gl)) return true;
  close_context(gl);
  return false;
}

static bool names_software(const char *renderer) {
  return strstr(renderer, "llvmpipe") || strstr(renderer, "softpipe") || strstr(renderer, "swrast") ||
         strstr(renderer, "SwiftShader") || strstr(renderer, "Software");
}

// The first display with a device of its own, else the first one that draws at all. `want_es` asks for OpenGL ES only.
static bool open_context(vt_gl *gl, bool want_es) {
  EGLDisplay displays[MAX_DISPLAYS];
  int count = list_displays(displays);
  for (int pass = 0; pass < 2; pass++) // 0: hardware, 1: any
    for (int i = 0; i < count; i++) {
      gl->display = displays[i];
      if (gl->display == EGL_NO_DISPLAY || !eglInitialize(gl->display, NULL, NULL)) continue;
      if ((want_es || !open_api(gl, false)) && !open_api(gl, true)) continue;
      const char *renderer = (const char *)glGetString(GL_RENDERER), *version = (const char *)glGetString(GL_VERSION);
      gl->software = renderer && names_software(renderer);
      if (renderer && (pass == 1 || !gl->software)) {
        snprintf(gl->name, sizeof gl->name, "%s, %s", renderer, version ? version : "");
        return true;
      }
      close_context(gl);
    }
  return false;
}

// ---- uploading

// A linear array of `count` elements of `size` bytes as an array texture. 0 and vt_fail on failure.
static GLuint upload_array(vt_context *context, const vt_gl *gl, const char *what, GLenum internal, GLenum format,
                           GLenum type, size_t size, const void *data, size_t count) {
  size_t rows = (count + LAYER_EDGE - 1) / LAYER_EDGE, layers = (rows + LAYER_EDGE - 1) / LAYER_EDGE;
  if (!rows) rows = layers = 1;
  if (layers > (size_t)gl->layers) {
    vt_fail(context, VT_FAILED, "OpenGL (%s): %s is too large for its textures; draw a coarser level, or on the CPU",
            gl->name, what);
    return 0;
  }
  int height = layers > 1 ? LAYER_EDGE : (int)rows;
  GLuint name = 0;
  glGenTextures(1, &name);
  glBindTexture(GL_TEXTURE_2D_ARRAY, name);
  glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAX_LEVEL, 0);
  glTexImage3D(GL_TEXTURE_2D_ARRAY, 0, (GLint)internal, LAYER_EDGE, height, (GLsizei)layers, 0, format, type, NULL);
  vt_status status = check_gl(context, gl, what);
  const uint8_t *bytes = data;
  for (size_t row = 0; row * LAYER_EDGE < count && !status;) {
    size_t left = count - row * LAYER_EDGE, in_layer = LAYER_EDGE - row % LAYER_EDGE;
    size_t whole = left / LAYER_EDGE < in_layer ? left / LAYER_EDGE : in_layer, width = LAYER_EDGE;
    if (!whole) whole = 1, width = left; // the last row
    glTexSubImage3D(GL_TEXTURE_2D_ARRAY, 0, 0, (GLint)(row % LAYER_EDGE), (GLint)(row / LAYER_EDGE), (GLsizei)width,
                    (GLsizei)whole, 1, format, type, bytes + row * LAYER_EDGE * size);
    row += whole;
  }
  if (!status) status = check_gl(context, gl, what);
  if (!status) return name;
  glDeleteTextures(1, &name);
  return 0;
}

// The same for an array of the caller's that is not needed afterwards.
static vt_status move_array(vt_context *context, const vt_gl *gl, const char *what, GLenum internal, GLenum format,
                            GLenum type, size_t size, void *data, size_t count, GLuint *out) {
  if (!data) return VT_OUT_OF_MEMORY;
  *out = upload_array(context, gl, what, internal, format, type, size, data, count);
  vt_free(context, data);
  return *out ? VT_OK : VT_FAILED;
}

static vt_status upload_tile_numbers(vt_context *context, const vt_gl *gl, int level, GLuint *out) {
  const vt_tiles *tiles = &gl->tree->tiles[level];
  size_t count = (size_t)tiles->view_count * tiles->cell_count, size = sizeof *tiles->tile_of;
  if (tiles->grid && tiles->tile_count > VT_GL_MAX_GRID_TILES)
    return vt_fail(context, VT_FAILED, "OpenGL (%s): too many tiles; draw a coarser level, or on the CPU", gl->name);
  if (tiles->grid)
    return move_array(context, gl, "the tile numbers", GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, size,
                      vt_gl_grid_tiles(context, gl->tree, level), count, out);
  *out = upload_array(context, gl, "the tile numbers", GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, size, tiles->tile_of, count);
  return *out ? VT_OK : VT_FAILED;
}

static vt_status upload_tiles(vt_context *context, vt_gl *gl, int level, GLuint arrays[LEVEL_ARRAYS]) {
  const vt_tree *tree = gl->tree;
  const vt_tiles *tiles = &tree->tiles[level];
  size_t texels = (size_t)tree->texel_edge * (size_t)tree->texel_edge;
  vt_status status = upload_tile_numbers(context, gl, level, &arrays[TILE_OF]);
  if (status) return status;
  if (!vt_is_packed(tree)) {
    if (tiles->tile_count <= UINT32_MAX / texels) // the shaders count texels in 32 bits
      arrays[TEXELS] = upload_array(context, gl, "the tiles", GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE, 4, tiles->texels,
                                    tiles->tile_count * texels);
    else vt_fail(context, VT_FAILED, "OpenGL (%s): too many tiles; draw a coarser level, or on the CPU", gl->name);
    return arrays[TEXELS] ? VT_OK : VT_FAILED;
  }
  const vt_codebook *alpha = &tree->alpha_codebook, *colour = &tree->colour_codebook;
  if (!gl->alphas)
    gl->alphas = upload_array(context, gl, "the alpha codebook", GL_R8, GL_RED, GL_UNSIGNED_BYTE, 1, alpha->codewords,
                              (size_t)alpha->codeword_count * texels);
  if (!gl->colours)
    gl->colours = upload_array(context, gl, "the colour codebook", GL_RGB8, GL_RGB, GL_UNSIGNED_BYTE, 3,
                               colour->codewords, (size_t)colour->codeword_count * texels);
  if (!gl->alphas || !gl->colours) return VT_FAILED;
  return move_array(context, gl, "the codes", GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, sizeof(uint32_t),
                    vt_gl_tile_codes(context, tiles), tiles->tile_count, &arrays[CODES]);
}

static vt_status upload_field(vt_context *context, const vt_gl *gl, const vt_level *level, GLuint arrays[LEVEL_ARRAYS]) {
  arrays[CORNERS] = upload_array(context, gl, "the cells' corners", GL_RGBA32UI, GL_RGBA_INTEGER, GL_UNSIGNED_INT,
                                 4 * sizeof *level->corner_of, level->corner_of, 2 * (size_t)level->cell_count);
  if (arrays[CORNERS])
    arrays[CORNER_VALUES] = upload_array(context, gl, "the field", GL_RGBA32F, GL_RGBA, GL_FLOAT, 4 * sizeof(float),
                                         level->corner_values, level->corner_count);
  return arrays[CORNER_VALUES] ? VT_OK : VT_FAILED;
}

static vt_status upload_ratios(vt_context *context, const vt_gl *gl, const vt_view_textures *textures,
                               GLuint arrays[LEVEL_ARRAYS]) {
  size_t count = 0;
  uint8_t *codes = vt_gl_ratio_codes(context, textures, &count);
  if (codes && count > UINT32_MAX) { // the shaders count in 32 bits
    vt_free(context, codes);
    return vt_fail(context, VT_FAILED, "OpenGL (%s): the views' textures are too large; draw a coarser level, or on the CPU",
                   gl->name);
  }
  return move_array(context, gl, "the views' textures", GL_R8UI, GL_RED_INTEGER, GL_UNSIGNED_BYTE, 1, codes, count,
                    &arrays[RATIOS]);
}

// What drawing this level needs and is not there yet.
static vt_status upload_level(vt_context *context, vt_gl *gl, int number, drawing_kind kind, bool flat) {
  const vt_level *level = &gl->tree->octree.levels[number];
  GLuint *arrays = gl->levels[number].arrays;
  bool tiles = kind == DRAW_TILES_SUM || kind == DRAW_TILES_GEOMETRIC;
  vt_status status = VT_OK;
  if (!arrays[CELLS])
    status = move_array(context, gl, "the cells", GL_RGBA16UI, GL_RGBA_INTEGER, GL_UNSIGNED_SHORT, 4 * sizeof(uint16_t),
                        vt_gl_places(context, level), level->cell_count, &arrays[CELLS]);
  if (!status && kind == DRAW_CONSTANT && !arrays[LOOKS])
    status = move_array(context, gl, "the cells' colours", GL_RGBA32F, GL_RGBA, GL_FLOAT, 4 * sizeof(float),
                        vt_gl_looks(context, level), level->cell_count, &arrays[LOOKS]);
  if (!status && kind == DRAW_FIELD && !arrays[CORNERS]) status = upload_field(context, gl, level, arrays);
  if (!status && tiles && !arrays[TILE_OF]) status = upload_tiles(context, gl, number, arrays);
  if (!status && !tiles && !flat && !arrays[RATIOS])
    status = upload_ratios(context, gl, &gl->tree->view_textures[number], arrays);
  if (!status) return VT_OK;
  glDeleteTextures(LEVEL_ARRAYS, arrays); // ignores 0
  memset(arrays, 0, sizeof gl->levels[number].arrays);
  return status;
}

// ---- programs

static GLuint compile(vt_context *context, const vt_gl *gl, GLenum stage, const char *defines, const char *body) {
  const char *version = gl->is_es ? "#version 300 es\nprecision highp float;\nprecision highp int;\n"
                                    "precision highp sampler2DArray;\nprecision highp usampler2DArray;\n"
                                  : "#version 330 core\n";
  const char *parts[] = {version, defines, vt_shader_shared, body};
  GLuint shader = glCreateShader(stage);
  glShaderSource(shader, 4, parts, NULL);
  glCompileShader(shader);
  GLint good = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &good);
  if (good) return shader;
  char text[1024] = "";
  glGetShaderInfoLog(shader, sizeof text, NULL, text);
  glDeleteShader(shader);
  vt_fail(context, VT_FAILED, "OpenGL (%s): a shader does not compile: %s; draw on the CPU", gl->name, text);
  return 0;
}

static void assign_samplers(GLuint program) {
  glUseProgram(program);
  for (int i = 0; i < LEVEL_ARRAYS + 2; i++) glUniform1i(glGetUniformLocation(program, sampler_names[i]), i); // -1 is ignored
}

static vt_status get_program(vt_context *context, vt_gl *gl, int views, drawing_kind kind, GLuint *out) {
  static const char *const kinds[] = {"#define TILES\n", "#define TILES\n#define GEOMETRIC\n", "", "#define FIELD\n"};
  GLuint *kept = &gl->programs[kind][views];
  int texels = gl->tree->texel_edge;
  if ((*out = *kept)) return VT_OK;
  char defines[320];
  snprintf(defines, sizeof defines, "#define VIEWS %d\n#define TEXELS %d\n#define LEAST_LOG_RATIO (%.9g)\n"
           "#define LOG_RATIO_STEP %.9g\n%s%s%s", views, texels, VT_LEAST_LOG_RATIO, VT_LOG_RATIO_STEP,
           LAYER_EDGE % (texels * texels) ? "" : "#define ONE_ROW\n", vt_is_packed(gl->tree) ? "#define PACKED\n" : "",
           kinds[kind]);
  GLuint vertex = compile(context, gl, GL_VERTEX_SHADER, defines, vt_vertex_shader);
  GLuint fragment = vertex ? compile(context, gl, GL_FRAGMENT_SHADER, defines, vt_fragment_shader) : 0;
  GLint good = 0;
  if (fragment) {
    *kept = glCreateProgram();
    glAttachShader(*kept, vertex);
    glAttachShader(*kept, fragment);
    glLinkProgram(*kept);
    glGetProgramiv(*kept, GL_LINK_STATUS, &good);
  }
  glDeleteShader(vertex);
  glDeleteShader(fragment);
  if (good) {
    assign_samplers(*kept);
    *out = *kept;
    return VT_OK;
  }
  if (*kept) {
    char text[1024] = "";
    glGetProgramInfoLog(*kept, sizeof text, NULL, text);
    vt_fail(context, VT_FAILED, "OpenGL (%s): the shaders do not link: %s; draw on the CPU", gl->name, text);
    glDeleteProgram(*kept);
    *kept = 0;
  }
  return VT_FAILED;
}

// ---- a picture

static GLint at(GLuint program, const char *name) { return glGetUniformLocation(program, name); }

static void set_vec3(GLuint program, const char *name, vt_vec3 v) {
  glUniform3f(at(program, name), (float)v.x, (float)v.y, (float)v.z);
}

static void set_camera(const vt_gl *gl, GLuint program, int number, const vt_camera *camera) {
  const vt_octree *octree = &gl->tree->octree;
  const double *r = camera->rotation.m;
  double half = 0.5 * octree->edge, edge = vt_cell_edge(octree, number);
  vt_vec3 centre = vt_add(octree->origin, vt_v3(half, half, half)), forward = vt_camera_forward(camera);
  vt_vec3 eye = vt_scale(vt_sub(vt_camera_centre(camera), centre), 1 / edge);
  double depth = -vt_dot(forward, eye);
  set_vec3(program, "right", vt_v3(r[0], r[1], r[2]));
  set_vec3(program, "down", vt_v3(r[3], r[4], r[5]));
  set_vec3(program, "forward", forward);
  set_vec3(program, "foot", vt_add(eye, vt_scale(forward, depth)));
  glUniform1f(at(program, "depth"), (float)depth);
  glUniform4f(at(program, "lens"), (float)(1 / camera->fx), (float)(1 / camera->fy), (float)(-camera->cx / camera->fx),
              (float)(-camera->cy / camera->fy));
  glUniform2f(at(program, "focal"), (float)camera->fx, (float)camera->fy);
  glUniform2f(at(program, "principal"), (float)camera->cx, (float)camera->cy);
  glUniform2f(at(program, "size"), (float)camera->width, (float)camera->height);
  glUniform1f(at(program, "middle_cell"), 0.5f * (float)octree->levels[number].axis_cells - 0.5f);
}

static void set_views(const vt_gl *gl, GLuint program, int number, const vt_view_weights *weights) {
  vt_gl_views views = vt_aim_gl_views(gl->tree, number, weights);
  int count = weights->count;
  glUniformMatrix3fv(at(program, "view_m"), count, GL_FALSE, views.m[0]);
  glUniform3fv(at(program, "view_b"), count, views.b[0]);
  glUniform1fv(at(program, "weight"), count, views.weight);
  glUniform1fv(at(program, "texel_rate"), count, views.texel_rate);
  glUniform1f(at(program, "grid"), (float)gl->tree->tiles[number].grid);
  glUniform1iv(at(program, "view"), count, weights->view);
  glUniform1ui(at(program, "cell_count"), gl->tree->octree.levels[number].cell_count);
  glUniform4fv(at(program, "kept"), count, views.kept[0]);
  glUniform2fv(at(program, "photograph"), count, views.photograph[0]);
  glUniform1uiv(at(program, "first_code"), count, views.first_code);
  glUniform1f(at(program, "linear"), views.linear);
}

static void bind_textures(const vt_gl *gl, int number) {
  const GLuint shared[] = {gl->alphas, gl->colours};
  for (GLuint i = 0; i < LEVEL_ARRAYS + 2; i++) {
    glActiveTexture(GL_TEXTURE0 + i);
    glBindTexture(GL_TEXTURE_2D_ARRAY, i < LEVEL_ARRAYS ? gl->levels[number].arrays[i] : shared[i - LEVEL_ARRAYS]);
  }
}

static vt_status size_picture(vt_context *context, vt_gl *gl, int width, int height) {
  if (width > gl->largest_picture || height > gl->largest_picture)
    return vt_fail(context, VT_FAILED, "OpenGL (%s): %d x %d pixels are more than its %d; draw on the CPU", gl->name,
                   width, height, gl->largest_picture);
  glViewport(0, 0, width, height);
  if (gl->picture_width == width && gl->picture_height == height) return VT_OK;
  gl->picture_width = gl->picture_height = 0;
  glBindRenderbuffer(GL_RENDERBUFFER, gl->picture);
  glRenderbufferStorage(GL_RENDERBUFFER, gl->picture_format, width, height);
  vt_status status = check_gl(context, gl, "the picture");
  if (status) return status;
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, gl->picture);
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    return vt_fail(context, VT_FAILED, "OpenGL (%s): cannot draw floating point pictures; draw on the CPU", gl->name);
  gl->picture_width = width;
  gl->picture_height = height;
  return VT_OK;
}

static vt_status upload_quads(vt_context *context, const vt_gl *gl, const vt_draw_list *list) {
  uint32_t(*quads)[6] = vt_gl_quads(context, list);
  if (!quads) return VT_OUT_OF_MEMORY;
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, (GLsizeiptr)(list->count * sizeof *quads), quads, GL_DYNAMIC_DRAW);
  vt_free(context, quads);
  return check_gl(context, gl, "the order of the cells");
}

static drawing_kind kind_of(const vt_tree *tree, int level, bool flat, vt_blend blend) {
  if (!flat && tree->tiles[level].view_count)
    return blend == VT_BLEND_GEOMETRIC ? DRAW_TILES_GEOMETRIC : DRAW_TILES_SUM;
  return tree->octree.levels[level].corner_count ? DRAW_FIELD : DRAW_CONSTANT;
}

static vt_status draw(vt_context *context, vt_gl *gl, int number, const vt_view_weights *weights, vt_blend blend,
                      const vt_camera *camera, const vt_draw_list *list, bool upload_list, vt_fimage *out) {
  GLuint program = 0;
  drawing_kind kind = kind_of(gl->tree, number, !weights, blend);
  vt_status status = upload_level(context, gl, number, kind, !weights);
  if (!status) status = get_program(context, gl, weights ? weights->count : 0, kind, &program);
  if (!status) status = size_picture(context, gl, camera->width, camera->height);
  if (status) return status;
  if (upload_list && (status = upload_quads(context, gl, list)) != VT_OK) return status;
  glUseProgram(program);
  set_camera(gl, program, number, camera);
  if (weights) set_views(gl, program, number, weights);
  bind_textures(gl, number);
  glClearColor(0, 0, 0, 0);
  glClear(GL_COLOR_BUFFER_BIT);
  glDrawElements(GL_TRIANGLES, (GLsizei)(6 * list->count), GL_UNSIGNED_INT, NULL);
  glReadPixels(0, 0, out->width, out->height, GL_RGBA, GL_FLOAT, out->pixels);
  return check_gl(context, gl, "drawing");
}

vt_status vt_draw_with_gl(vt_context *context, vt_gl *gl, int level, const vt_view_weights *weights, vt_blend blend,
                          const vt_camera *camera, const vt_draw_list *list, bool upload_list, vt_fimage *out) {
  if (!list->count) return VT_OK; // the picture is empty already
  current_context old = get_current();
  vt_status status = VT_OK;
  if (make_current(gl))
    status = draw(context, gl, level, weights, blend, camera, list, upload_list, out);
  else
    status = vt_fail(context, VT_FAILED, "OpenGL (%s): no context: %s; draw on the CPU", gl->name, egl_error());
  put_back(&old, gl->display);
  return status;
}

// ---- making and destroying

static vt_status set_up(vt_context *context, vt_gl *gl) {
  GLint size = 0, viewport[2] = {0};
  glGetIntegerv(GL_MAX_RENDERBUFFER_SIZE, &size);
  glGetIntegerv(GL_MAX_VIEWPORT_DIMS, viewport);
  glGetIntegerv(GL_MAX_ARRAY_TEXTURE_LAYERS, &gl->layers);
  gl->largest_picture = size < viewport[0] ? size : viewport[0];
  if (viewport[1] < gl->largest_picture) gl->largest_picture = viewport[1];
  bool full = !gl->is_es || (epoxy_has_gl_extension("GL_EXT_color_buffer_float") &&
                             epoxy_has_gl_extension("GL_EXT_float_blend"));
  gl->picture_format = full ? GL_RGBA32F : GL_RGBA16F;
  glGenVertexArrays(1, &gl->vertex_array);
  glBindVertexArray(gl->vertex_array);
  glGenBuffers(1, &gl->list);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, gl->list);
  glGenFramebuffers(1, &gl->framebuffer);
  glBindFramebuffer(GL_FRAMEBUFFER, gl->framebuffer);
  glGenRenderbuffers(1, &gl->picture);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_DITHER);
  glEnable(GL_BLEND);
  glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  return check_gl(context, gl, "setting up");
}

vt_status vt_create_gl(vt_context *context, const vt_tree *tree, vt_gl **out) {
  *out = NULL;
  vt_gl *gl = VT_NEW(context, vt_gl, 1);
  if (!gl) return VT_OUT_OF_MEMORY;
  gl->tree = tree;
  gl->surface = EGL_NO_SURFACE;
  gl->context = EGL_NO_CONTEXT;
  current_context old = get_current();
  vt_status status;
  if (open_context(gl, false)) {
    status = set_up(context, gl);
    put_back(&old, gl->display);
  } else {
    status = vt_fail(context, VT_MISSING_PROGRAM,
                     "OpenGL: no driver offers OpenGL 3.3 or OpenGL ES 3.0 (%s); install one, or draw on the CPU",
                     egl_error());
    eglBindAPI(old.api);
  }
  if (status) vt_destroy_gl(context, gl);
  else *out = gl;
  return status;
}

void vt_destroy_gl(vt_context *context, vt_gl *gl) {
  if (!gl) return;
  current_context old = get_current();
  bool was_ours = old.context == gl->context;
  if (gl->context != EGL_NO_CONTEXT) {
    close_context(gl); // takes everything made in it along
    if (was_ours) old.context = EGL_NO_CONTEXT;
    put_back(&old, gl->display);
  }
  vt_free(context, gl);
}

const char *vt_gl_name(const vt_gl *gl) { return gl->name; }
