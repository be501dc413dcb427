    -1
   151
NONE
NONE
jointfrf
NONE      NONE               0         0         0
NONE      NONE      
jointfrf
NONE      NONE      
    -1
    -1
   164
         1SI: m, N                     2
   1.0000000000000000D+00   1.0000000000000000D+00   1.0000000000000000D+00
   2.7314999999999998D+02
    -1
    -1
    58b     1     2          11          80     0     0           0           0
FRF 1:+x / 1:+x
NONE
NONE
NONE
NONE
    4         0    0         0 NONE               1   1 NONE               1   1
         6         5         1 10.000000000 10.000000000 0.0000000000
        18    0    0    0 Frequency            Hz                  
         8    0    0    0 Response             m                   
        13    0    0    0 Excitation           N                   
         0    0    0    0 NONE                 NONE                
©$£l©é¿)¸^vÓæ¿{oü ?-ò?“7Ú?'YÊ°¹õç?¼{GHbï¿bÄÇÊªî¿º‰…Âe£¿êæòmµ¿g_Kvñ¿
    -1
    -1
    58b     1     2          11          80     0     0           0           0
FRF 1:+x / 2:-y
NONE
NONE
NONE
NONE
    4         0    0         0 NONE               1   1 NONE               2  -2
         6         5         1 10.000000000 10.000000000 0.0000000000
        18    0    0    0 Frequency            Hz                  
         8    0    0    0 Response             m                   
        13    0    0    0 Excitation           N                   
         0    0    0    0 NONE                 NONE                
>.æ“0õ¿ÓJÄFµá?ãÃ?õ·¼?Ž±‡·,Žê?Ïÿ˜C(ú?püôMó)Æ¿_¡Ã­™ù?‡ƒÓEzÓ¿ìØœÖ’œò¿†=Ã]ï®õ¿
    -1
    -1
    58b     1     2          11          80     0     0           0           0
FRF 2:-y / 1:+x
NONE
NONE
NONE
NONE
    4         0    0         0 NONE               2  -2 NONE               1   1
         6         5         1 10.000000000 10.000000000 0.0000000000
        18    0    0    0 Frequency            Hz                  
         8    0    0    0 Response             m                   
        13    0    0    0 Excitation           N                   
         0    0    0    0 NONE                 NONE                
j„=JPÊÏ¿ÝgAúf&°¿ÏšýnI¯á¿GìßÒIú¿Íßç*uÑ?šƒBu¡ô¿ÍduCøÉ?¦A•NÄð¿¥5øÈ #ä¿æÂdÇÅÌ?
    -1
    -1
    58b     1     2          11          80     0     0           0           0
FRF 2:-y / 2:-y
NONE
NONE
NONE
NONE
    4         0    0         0 NONE               2  -2 NONE               2  -2
         6         5         1 10.000000000 10.000000000 0.0000000000
        18    0    0    0 Frequency            Hz                  
         8    0    0    0 Response             m                   
        13    0    0    0 Excitation           N                   
         0    0    0    0 NONE                 NONE                
¸Ð$“èÚ?ƒ¯ñžÜâ¿ãæ±ëé¿ÍÐ(2DnÐ¿_´SÖ¶»ó¿eîÖÜ/•?_¤HÓ¶û¿8å°.[Ù¿}ÓÎÆ|;ß¿?q¸å¿ñ¿
    -1
