// image_file_oiio.cc - pictures on disk and in memory through OpenImageIO 2.4
// SPDX-License-Identifier: BSD-3-Clause
//
// What OpenImageIO does unless told otherwise, and what we need: it multiplies colour by alpha on reading and divides
// on writing (we ask for straight values both ways, so that even the colour under alpha 0 survives); it gives back
// half-read pictures with a text in geterror() and no failure (we fail); it starts threads of its own (we have workers
// already); it turns RAW pictures upright, which it does with no other format (we take the sensor's rows, and the turn apart).
// Rows come in strips: a header that promises more than the file holds fails at its first strip.
#include "base/image_pam.h"

#include "base/file.h"
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

using OIIO::ImageInput;
using OIIO::ImageOutput;
using OIIO::ImageSpec;

namespace {

const int strip_rows = 256;

struct vt_block { // memory of the context that an exception cannot lose
  vt_context *context;
  void *bytes;
  vt_block(vt_context *c, size_t count, size_t size) : context(c), bytes(vt_alloc(c, count, size)) {}
  ~vt_block() { vt_free(context, bytes); }
  vt_block(const vt_block &) = delete;
  vt_block &operator=(const vt_block &) = delete;
};

std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text.empty() ? "no reason given" : text;
}

vt_status fail_damaged(vt_context *context, const char *path, const std::string &why) {
  return vt_fail(context, VT_BAD_INPUT, "%s: cannot be decoded: %s; copy it again from the camera or leave it out",
                 path, one_line(why).c_str());
}

void set_threads() {
  static const int set_once = int(OIIO::attribute("threads", 1)) + int(OIIO::attribute("exr_threads", -1)) +
                              int(OIIO::attribute("tiff:multithread", 0));
  (void)set_once;
}

vt_status check_spec(vt_context *context, const char *path, const ImageInput &input) {
  const ImageSpec &spec = input.spec();
  if (spec.width < 1 || spec.height < 1 || spec.depth > 1 || spec.nchannels < 1 || spec.deep)
    return vt_fail(context, VT_BAD_INPUT, "%s: is no flat picture; convert it to PNG or JPEG", path);
  if (spec.width > VT_MAX_IMAGE_SIDE || spec.height > VT_MAX_IMAGE_SIDE || spec.nchannels > 64)
    return vt_fail(context, VT_BAD_INPUT,
                   "%s: has %d x %d pixels of %d channels, over 65535 a side or 64 channels; "
                   "reduce it",
                   path, spec.width, spec.height, spec.nchannels);
  if (!strcmp(input.format_name(), "openexr") && (spec.x != spec.full_x || spec.y != spec.full_y ||
                                                  spec.width != spec.full_width || spec.height != spec.full_height))
    return vt_fail(context, VT_BAD_INPUT, "%s: holds a part of its picture only (data window); save the whole picture",
                   path);
  return VT_OK;
}

// raw_flip: LibRaw's turn of a RAW picture, 0 for the sensor's rows as in every other format; -1: upright.
vt_status open_picture(vt_context *context, const char *path, int raw_flip, std::unique_ptr<ImageInput> &input) {
  set_threads();
  if (vt_is_folder(path)) return vt_fail(context, VT_BAD_INPUT, "%s: is a folder; give a picture", path);
  if (!vt_is_file(path)) return vt_fail(context, VT_BAD_INPUT, "%s: there is no such file; check the path", path);
  if (OIIO::Filesystem::file_size(path) == 0)
    return vt_fail(context, VT_BAD_INPUT, "%s: is empty; copy it again from the camera or leave it out", path);
  if (vt_is_cut_png(path)) return fail_damaged(context, path, "the file ends too early");
  ImageSpec hints;
  hints.attribute("oiio:UnassociatedAlpha", 1);
  hints.attribute("raw:user_flip", raw_flip);
  // By the ending first: ImageInput::open() takes '?' in a name for options. By the content if the ending lies.
  const char *dot = strrchr(vt_base_name(path), '.');
  ImageSpec spec;
  std::string why;
  if (dot && dot[1]) input = ImageInput::create(dot + 1);
  if (input && !input->open(path, spec, hints)) {
    why = input->geterror();
    input.reset();
  }
  if (!input) {
    input = ImageInput::open(path, &hints);
    std::string other = OIIO::geterror();
    if (!input) return fail_damaged(context, path, why.empty() ? other : why);
    spec = input->spec();
  }
  return check_spec(context, path, *input);
}

// By the first bytes: the name stands for a part of another file.
vt_status open_bytes(vt_context *context, const uint8_t *bytes, size_t size, const char *name,
                     OIIO::Filesystem::IOMemReader &reader, std::unique_ptr<ImageInput> &input) {
  static const struct {
    const char *magic, *format;
    size_t at, length;
  } kinds[] = {{"\x89PNG", "png", 0, 4}, {"\xff\xd8\xff", "jpeg", 0, 3}, {"WEBP", "webp", 8, 4},
               {"II*\0", "tiff", 0, 4},  {"MM\0*", "tiff", 0, 4},        {"BM", "bmp", 0, 2}};
  set_threads();
  const char *format = nullptr;
  for (const auto &kind : kinds)
    if (!format && size >= kind.at + kind.length && !memcmp(bytes + kind.at, kind.magic, kind.length))
      format = kind.format;
  if (!format)
    return vt_fail(context, VT_BAD_INPUT, "%s: holds no PNG, JPEG, WebP, TIFF, BMP or PAM picture; write it again",
                   name);
  if (vt_are_cut_png_bytes(bytes, size)) return fail_damaged(context, name, "it ends too early");
  ImageSpec hints, spec;
  hints.attribute("oiio:UnassociatedAlpha", 1);
  input = ImageInput::create(format, false, nullptr, &reader);
  if (!input) return fail_damaged(context, name, OIIO::geterror());
  if (!input->set_ioproxy(&reader) || !input->open(std::string("memory.") + format, spec, hints))
    return fail_damaged(context, name, input->geterror());
  return check_spec(context, name, *input);
}

struct vt_layout {      // which channels of the file are ours
  int colour[3], alpha; // alpha -1: none
  bool divide;          // colour is multiplied by alpha
  bool linear;          // not sRGB-encoded
  bool wide;            // floating point in the file
};

vt_layout layout_of(const ImageSpec &spec, const char *format) {
  vt_layout l = {{0, 0, 0}, spec.alpha_channel, false, false, false};
  if (l.alpha >= spec.nchannels || spec.nchannels == 1) l.alpha = -1;
  if (spec.nchannels >= 3) {
    static const char *const names[3] = {"R", "G", "B"};
    int found[3] = {0, 0, 0};
    for (int c = 0; c < 3; c++) found[c] = spec.channelindex(names[c]);
    bool named = found[0] >= 0 && found[1] >= 0 && found[2] >= 0;
    for (int c = 0; c < 3; c++) l.colour[c] = named ? found[c] : c;
  }
  l.divide = l.alpha >= 0 && !spec.get_int_attribute("oiio:UnassociatedAlpha") &&
             strcmp(format, "bmp"); // BMP: always straight
  l.wide = spec.format.is_floating_point();
  l.linear = l.wide && spec.get_string_attribute("oiio:ColorSpace") != "sRGB";
  return l;
}

uint8_t to_byte(float v) {
  return (uint8_t)(v > 0 ? (v < 1 ? v * 255.0f + 0.5f : 255.0f) : 0.0f);
} // NaN is 0

float encode_srgb(float v) {
  return v <= 0.0031308f ? 12.92f * v : 1.055f * std::pow(v, 1 / 2.4f) - 0.055f;
}

void convert_float(const vt_layout &l, const float *from, size_t stride, size_t count, int channels, uint8_t *to) {
  for (size_t i = 0; i < count; i++, from += stride, to += channels) {
    float alpha = l.alpha >= 0 ? from[l.alpha] : 1, scale = l.divide && alpha > 0 ? 1 / alpha : 1;
    for (int c = 0; c < 3; c++) {
      float v = from[l.colour[c]] * scale;
      to[c] = to_byte(l.linear ? encode_srgb(v) : v);
    }
    if (channels == 4) to[3] = to_byte(alpha);
  }
}

void convert_bytes(const vt_layout &l, const uint8_t *from, size_t stride, size_t count, int channels, uint8_t *to) {
  for (size_t i = 0; i < count; i++, from += stride, to += channels) {
    unsigned alpha = l.alpha >= 0 ? from[l.alpha] : 255;
    for (int c = 0; c < 3; c++) {
      unsigned v = from[l.colour[c]];
      to[c] = (uint8_t)(l.divide && alpha ? std::min(255u, (v * 255u + alpha / 2) / alpha) : v);
    }
    if (channels == 4) to[3] = (uint8_t)alpha;
  }
}

// A message that leaves all pixels as they are: cameras write stray bytes between the segments of a JPEG.
bool is_harmless(const std::string &message) {
  return message.find("extraneous bytes before marker") != message.npos;
}

vt_status read_pixels(vt_context *context, const char *path, ImageInput &input, vt_image *out) {
  const ImageSpec spec = input.spec();
  const vt_layout l = layout_of(spec, input.format_name());
  uint64_t need = (uint64_t)spec.width * (uint64_t)spec.height * (l.alpha >= 0 ? 4 : 3), bound = vt_max_memory(context);
  if (bound && need > bound - std::min(bound, vt_bytes_in_use(context)))
    return vt_fail(context, VT_OUT_OF_MEMORY,
                   "%s: %d x %d pixels do not fit into the memory bound; raise the bound or "
                   "reduce the picture",
                   path, spec.width, spec.height);
  vt_status status = vt_make_image(context, spec.width, spec.height, l.alpha >= 0 ? 4 : 3, out);
  if (status) return status;
  int rows = spec.tile_width ? std::max(1, spec.tile_height) : strip_rows;
  size_t stride = (size_t)spec.nchannels, width = (size_t)spec.width;
  vt_block strip(context, (size_t)std::min(rows, spec.height) * width, stride * (l.wide ? sizeof(float) : 1));
  if (!strip.bytes) return VT_OUT_OF_MEMORY;
  OIIO::TypeDesc type = l.wide ? OIIO::TypeDesc::FLOAT : OIIO::TypeDesc::UINT8;
  for (int y = 0; y < spec.height; y += rows) {
    if (vt_cancelled(context)) return VT_CANCELLED;
    int end = std::min(y + rows, spec.height);
    bool good = spec.tile_width ? input.read_tiles(0, 0, spec.x, spec.x + spec.width, spec.y + y, spec.y + end, spec.z,
                                                   spec.z + 1, 0, spec.nchannels, type, strip.bytes)
                                : input.read_scanlines(0, 0, spec.y + y, spec.y + end, spec.z, 0, spec.nchannels, type,
                                                       strip.bytes);
    std::string message = input.geterror();
    if (!good || (!message.empty() && !is_harmless(message))) return fail_damaged(context, path, message);
    size_t count = (size_t)(end - y) * width;
    uint8_t *to = out->pixels + (size_t)y * width * (size_t)out->channels;
    if (l.wide)
      convert_float(l, (const float *)strip.bytes, stride, count, out->channels, to);
    else
      convert_bytes(l, (const uint8_t *)strip.bytes, stride, count, out->channels, to);
  }
  if (!input.close()) return fail_damaged(context, path, input.geterror());
  return VT_OK;
}

void copy_text(const ImageSpec &spec, const char *name, char (&to)[64]) {
  snprintf(to, sizeof to, "%s", std::string(spec.get_string_attribute(name)).c_str());
}

double positive(double value) {
  return std::isfinite(value) && value > 0 ? value : 0;
}

vt_status encode_picture(vt_context *context, const char *path, const vt_image *image, const char *format,
                         std::vector<unsigned char> &bytes) {
  OIIO::Filesystem::IOVecOutput memory(bytes);
  auto output = ImageOutput::create(format, &memory);
  if (!output) return vt_fail(context, VT_FAILED, "%s: OpenImageIO cannot write %s; write .png or .pam", path, format);
  ImageSpec spec(image->width, image->height, image->channels, OIIO::TypeDesc::UINT8);
  spec.attribute("oiio:UnassociatedAlpha", 1);
  spec.attribute("DateTime", "    :  :     :  :  "); // EXIF for "unknown": the same picture gives the same bytes
  if (!strcmp(format, "png")) {
    spec.attribute("oiio:ColorSpace",
                   "sRGB"); // in TIFF it would make an EXIF directory, which 2.4 writes wrongly to memory
    spec.attribute("png:compressionLevel", 3);
  }
  if (!strcmp(format, "jpeg")) {
    spec.attribute("compression", "jpeg:92");
    spec.attribute("jpeg:subsampling", "4:4:4"); // leaves are thinner than two pixels
  }
  if (!strcmp(format, "tiff")) spec.attribute("compression", "zip");
  if (!output->open(std::string("memory.") + format, spec) ||
      !output->write_image(OIIO::TypeDesc::UINT8, image->pixels) || !output->close())
    return vt_fail(context, VT_FAILED, "%s: cannot be encoded: %s; choose another format", path,
                   one_line(output->geterror()).c_str());
  return VT_OK;
}

template <class Work> vt_status at_border(vt_context *context, const char *path, Work work) {
  try {
    return work();
  } catch (const std::bad_alloc &) {
    return vt_fail(context, VT_OUT_OF_MEMORY, "%s: the system has no memory for it; close other programs", path);
  } catch (const std::exception &e) {
    return vt_fail(context, VT_BAD_INPUT, "%s: OpenImageIO stopped: %s; convert it to PNG", path, e.what());
  } catch (...) {
    return vt_fail(context, VT_BAD_INPUT, "%s: OpenImageIO stopped; convert it to PNG", path);
  }
}

} // namespace

vt_status vt_read_image_info(vt_context *context, const char *path, vt_image_info *out) {
  memset(out, 0, sizeof *out);
  if (vt_has_ending(path, "pam")) return vt_read_pam_info(context, path, out);
  return at_border(context, path, [&] {
    std::unique_ptr<ImageInput> input;
    vt_status status = open_picture(context, path, -1, input); // with 0 it would not say how it is turned
    if (status) return status;
    const ImageSpec &spec = input->spec();
    out->width = spec.width;
    out->height = spec.height;
    int orientation = spec.get_int_attribute("Orientation", 1);
    if (!strcmp(input->format_name(), "raw")) { // LibRaw's numbers: 3, 5 and 6 are a half turn, a quarter left, a quarter right
      int flip = spec.get_int_attribute("raw:flip");
      orientation = flip == 3 ? 3 : flip == 5 ? 8 : flip == 6 ? 6 : 1;
      if (orientation > 4) std::swap(out->width, out->height);
    }
    if (!strcmp(input->format_name(), "heif")) orientation = 1; // libheif has turned the pixels, whatever the header says
    out->channels = spec.nchannels;
    out->orientation = orientation >= 1 && orientation <= 8 ? orientation : 1;
    out->focal_35mm = positive(spec.get_float_attribute("Exif:FocalLengthIn35mmFilm"));
    out->focal_mm = positive(spec.get_float_attribute("Exif:FocalLength"));
    copy_text(spec, "Make", out->make);
    copy_text(spec, "Model", out->model);
    return VT_OK;
  });
}

vt_status vt_read_image(vt_context *context, const char *path, vt_image *out) {
  memset(out, 0, sizeof *out);
  if (vt_has_ending(path, "pam")) return vt_read_pam(context, path, out);
  vt_status status = at_border(context, path, [&] {
    std::unique_ptr<ImageInput> input;
    vt_status opened = open_picture(context, path, 0, input);
    return opened ? opened : read_pixels(context, path, *input, out);
  });
  if (status) vt_free_image(context, out);
  return status;
}

static const char *format_of(const char *path) {
  return vt_has_ending(path, "png")                                  ? "png"
         : vt_has_ending(path, "jpg") || vt_has_ending(path, "jpeg") ? "jpeg"
         : vt_has_ending(path, "tif") || vt_has_ending(path, "tiff") ? "tiff"
                                                                     : NULL;
}

bool vt_is_output_name(const char *path, bool alpha) {
  const char *format = format_of(path);
  return vt_has_ending(path, "pam") || (format && !(alpha && !strcmp(format, "jpeg")));
}

vt_status vt_write_image(vt_context *context, const char *path, const vt_image *image) {
  VT_ASSERT(image->channels == 1 || image->channels == 3 || image->channels == 4);
  if (vt_has_ending(path, "pam")) return vt_write_pam(context, path, image);
  const char *format = format_of(path);
  if (!format)
    return vt_fail(context, VT_FAILED, "%s: unknown kind of picture; end its name in .png, .jpg, .tif or .pam", path);
  if (image->channels == 4 && !strcmp(format, "jpeg"))
    return vt_fail(context, VT_FAILED, "%s: JPEG keeps no transparency; end its name in .png", path);
  return at_border(context, path, [&] {
    std::vector<unsigned char> bytes;
    vt_status status = encode_picture(context, path, image, format, bytes);
    return status ? status : vt_write_file(context, path, bytes.data(), bytes.size());
  });
}

vt_status vt_decode_image(vt_context *context, const uint8_t *bytes, size_t size, const char *name, vt_image *out) {
  memset(out, 0, sizeof *out);
  if (vt_is_pam(bytes, size)) return vt_parse_pam(context, bytes, size, name, out);
  vt_status status = at_border(context, name, [&] {
    OIIO::Filesystem::IOMemReader reader(const_cast<uint8_t *>(bytes), size); // it only reads
    std::unique_ptr<ImageInput> input;
    vt_status opened = open_bytes(context, bytes, size, name, reader, input);
    return opened ? opened : read_pixels(context, name, *input, out);
  });
  if (status) vt_free_image(context, out);
  return status;
}

vt_status vt_encode_png(vt_context *context, const vt_image *image, uint8_t **bytes, size_t *size) {
  VT_ASSERT(image->channels == 1 || image->channels == 3 || image->channels == 4);
  *bytes = NULL;
  *size = 0;
  return at_border(context, "PNG", [&] {
    std::vector<unsigned char> encoded;
    vt_status status = encode_picture(context, "PNG", image, "png", encoded);
    if (status) return status;
    *bytes = VT_NEW(context, uint8_t, encoded.size());
    if (!*bytes) return VT_OUT_OF_MEMORY;
    memcpy(*bytes, encoded.data(), encoded.size());
    *size = encoded.size();
    return VT_OK;
  });
}
