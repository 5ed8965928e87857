/* webp.c: writes an animated WebP. No other file includes libwebp. Lossy at a fixed quality, without metadata: the
 * same pictures give the same bytes.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "view/webp.h"

#include <stdlib.h>
#include <webp/encode.h>
#include <webp/mux.h>

static const float quality = 80;

struct vgi_webp {
    size_t w, h;
    WebPAnimEncoder *encoder;
    WebPConfig config;
};

static int webp_fails(const vgi_webp *p, vg_err *e)
{
    const char *why = p->encoder ? WebPAnimEncoderGetError(p->encoder) : "";
    return vg_fail(e, VG_ENOMEM, "cannot encode the animation%s%s", why && *why ? ": " : "", why ? why : "");
}

int vgi_webp_open(vgi_webp **out, size_t w, size_t h, vg_err *e)
{
    WebPAnimEncoderOptions o;
    *out = NULL;
    if (w < 1 || h < 1 || w > WEBP_MAX_DIMENSION || h > WEBP_MAX_DIMENSION)
        return vg_fail(e, VG_EARG, "an animation of %zu x %zu pixels is larger than WebP allows (%d)", w, h,
                       WEBP_MAX_DIMENSION);
    vgi_webp *p = vgi_array(1, sizeof *p, e);
    if (!p) return VG_ENOMEM;
    p->w = w, p->h = h;
    if (!WebPAnimEncoderOptionsInit(&o) || !WebPConfigPreset(&p->config, WEBP_PRESET_DRAWING, quality)) {
        vgi_webp_close(&p);
        return vg_fail(e, VG_ESYS, "libwebp is not the version that this program was built with");
    }
    p->config.method = 4;
    p->encoder = WebPAnimEncoderNew((int)w, (int)h, &o);
    if (!p->encoder) {
        vgi_webp_close(&p);
        return vg_fail(e, VG_ENOMEM, "not enough memory for an animation");
    }
    *out = p;
    return VG_OK;
}

int vgi_webp_add(vgi_webp *p, const unsigned char *rgb, int milliseconds, vg_err *e)
{
    WebPPicture picture;
    if (!WebPPictureInit(&picture)) return webp_fails(p, e);
    picture.use_argb = 1;
    picture.width = (int)p->w, picture.height = (int)p->h;
    bool ok = WebPPictureImportRGB(&picture, rgb, (int)(3 * p->w)) &&
              WebPAnimEncoderAdd(p->encoder, &picture, milliseconds, &p->config);
    WebPPictureFree(&picture);
    return ok ? VG_OK : webp_fails(p, e);
}

int vgi_webp_end(vgi_webp *p, int milliseconds, vg_bytes *out, vg_err *e)
{
    WebPData data;
    WebPDataInit(&data);
    bool ok = WebPAnimEncoderAdd(p->encoder, NULL, milliseconds, NULL) && WebPAnimEncoderAssemble(p->encoder, &data);
    int r = ok ? vgi_bytes_append(out, data.bytes, data.size, e) : webp_fails(p, e);
    WebPDataClear(&data);
    return r;
}

void vgi_webp_close(vgi_webp **p)
{
    if (!*p) return;
    WebPAnimEncoderDelete((*p)->encoder);
    free(*p);
    *p = NULL;
}
