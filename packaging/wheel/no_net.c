/* What HDF5 of Debian asks of libcurl and OpenSSL to read files over the net, which kschur never does: it fails here. So
 * the wheel bundles neither, nor the thirty libraries below them, which would want security updates. */
#include <stddef.h>

#ifdef LIBCURL
int curl_global_init(long flags) { (void)flags; return 2; }
void curl_global_cleanup(void) { }
void *curl_easy_init(void) { return NULL; }
int curl_easy_setopt(void *handle, int option, ...) { (void)handle; (void)option; return 2; }
int curl_easy_perform(void *handle) { (void)handle; return 2; }
void curl_easy_cleanup(void *handle) { (void)handle; }
void *curl_slist_append(void *list, const char *text) { (void)list; (void)text; return NULL; }
void curl_slist_free_all(void *list) { (void)list; }
#else
const void *EVP_sha256(void) { return NULL; }

unsigned char *HMAC(const void *kind, const void *key, int key_length, const unsigned char *text, size_t length,
                    unsigned char *sum, unsigned *sum_length)
{
   (void)kind; (void)key; (void)key_length; (void)text; (void)length; (void)sum; (void)sum_length;
   return NULL;
}

unsigned char *SHA256(const unsigned char *text, size_t length, unsigned char *sum)
{
   (void)text; (void)length; (void)sum;
   return NULL;
}
#endif
