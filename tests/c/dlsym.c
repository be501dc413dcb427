/* Looks a function up in all that a program of Windows has loaded, as dlsym(RTLD_DEFAULT, name) does elsewhere. */
#include <windows.h>
#include <psapi.h>

void *dlsym(void *handle, const char *name)
{
    HMODULE loaded[1024];
    DWORD bytes = 0, i;

    (void)handle;
    if (!EnumProcessModules(GetCurrentProcess(), loaded, sizeof loaded, &bytes))
        return NULL;
    for (i = 0; i < bytes / sizeof loaded[0] && i < sizeof loaded / sizeof loaded[0]; i++) {
        FARPROC found = GetProcAddress(loaded[i], name);

        if (found != NULL)
            return (void *)(INT_PTR)found;
    }
    return NULL;
}
